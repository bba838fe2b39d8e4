#include "server/store/blob_writer.h"

#include <fcntl.h>

#include <cstdio>
#include <utility>

#include "server/store/failpoint.h"

namespace radbake::store {

Result<std::unique_ptr<BlobWriter>> BlobWriter::create(const std::filesystem::path& temporary) {
  RADBAKE_ASSIGN_OR_RETURN(FileDescriptor file, open_file(temporary, O_WRONLY | O_CREAT | O_EXCL, kName));
  return std::unique_ptr<BlobWriter>(new BlobWriter(temporary, std::move(file)));
}

Result<std::unique_ptr<BlobWriter>> BlobWriter::resume(const std::filesystem::path& temporary) {
  RADBAKE_ASSIGN_OR_RETURN(FileDescriptor file, open_file(temporary, O_RDWR | O_CREAT, kName));
  std::unique_ptr<BlobWriter> writer(new BlobWriter(temporary, std::move(file)));
  constexpr std::uint64_t kPieceBytes = 1 << 20;
  while (true) {
    RADBAKE_ASSIGN_OR_RETURN(const std::string piece,
                             read_range(writer->file_.get(), writer->size_, kPieceBytes, kName));
    if (piece.empty()) return writer;
    writer->hash_.update(std::as_bytes(std::span(piece)));
    writer->size_ += piece.size();
  }
}

BlobWriter::BlobWriter(std::filesystem::path temporary, FileDescriptor file)
    : temporary_(std::move(temporary)), file_(std::move(file)) {}

BlobWriter::~BlobWriter() {
  if (!is_kept_) ::unlink(temporary_.c_str());
}

Result<void> BlobWriter::append(std::span<const std::byte> bytes) {
  RADBAKE_RETURN_IF_ERROR(write_all(file_.get(), bytes, size_, kName));
  hash_.update(bytes);
  size_ += bytes.size();
  return {};
}

Result<void> BlobWriter::publish(const Digest& expected, const std::filesystem::path& name) {
  if (size_ != expected.size_bytes) {
    return Error{ErrorCode::kDataLoss, "blob " + expected.sha256 + " has " + std::to_string(size_) +
                                           " bytes, not the " + std::to_string(expected.size_bytes) + " of its digest"};
  }
  const std::string sha256 = hash_.finish();
  if (sha256 != expected.sha256) {
    return Error{ErrorCode::kDataLoss,
                 "the bytes sent for blob " + expected.sha256 + " have the digest " + sha256 + ": send them again"};
  }
  // The bytes must be on the disk before the name is: a name is a promise.
  failpoint("blob.written");
  RADBAKE_RETURN_IF_ERROR(force());
  failpoint("blob.synced");
  if (std::rename(temporary_.c_str(), name.c_str()) != 0) return system_error("cannot name " + std::string(kName));
  is_kept_ = true;
  return {};
}

}  // namespace radbake::store

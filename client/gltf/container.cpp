#include "client/gltf/container.h"

#include <fstream>
#include <system_error>

#include "client/gltf/limits.h"

namespace radbake::gltf {
namespace {

constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinChunk = 0x004E4942;

std::uint32_t u32_at(const std::string& bytes, std::size_t offset) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
  return value;
}

Result<Container> split_chunks(const std::string& bytes) {
  if (bytes.size() < kHeaderBytes + kChunkHeaderBytes) {
    return invalid_argument("truncated: " + std::to_string(bytes.size()) + " bytes are too few for a binary glTF");
  }
  if (const std::uint32_t version = u32_at(bytes, 4); version != 2) {
    return invalid_argument("binary glTF of version " + std::to_string(version) + "; only version 2 is read");
  }
  const std::size_t length = u32_at(bytes, 8);
  if (length > bytes.size()) {
    return invalid_argument("truncated: the header says " + std::to_string(length) + " bytes, the file has " +
                            std::to_string(bytes.size()));
  }
  Container parts;
  std::size_t offset = kHeaderBytes;
  for (int chunk = 0; offset + kChunkHeaderBytes <= length; ++chunk) {
    const std::size_t size = u32_at(bytes, offset);
    const std::uint32_t type = u32_at(bytes, offset + 4);
    offset += kChunkHeaderBytes;
    if (size > length - offset) {
      return invalid_argument("truncated: chunk " + std::to_string(chunk) + " says " + std::to_string(size) +
                              " bytes, " + std::to_string(length - offset) + " are left");
    }
    if (chunk == 0 && type != kJsonChunk) return invalid_argument("not a binary glTF: its first chunk is not JSON");
    if (chunk == 0) parts.json = bytes.substr(offset, size);
    if (chunk == 1 && type == kBinChunk) parts.bin = bytes.substr(offset, size);
    offset += size;
  }
  return parts;
}

}  // namespace

Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t max_bytes) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return invalid_argument("no such file");
  // A pipe or a device could block or never end.
  if (!std::filesystem::is_regular_file(path, error)) return invalid_argument("not a regular file");
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) return invalid_argument("its size cannot be read: " + error.message());
  if (size > max_bytes) {
    return invalid_argument(std::to_string(size) + " bytes are above the limit of " + std::to_string(max_bytes));
  }
  std::string bytes(size, '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file) return invalid_argument("cannot be opened: no permission to read it?");
  file.read(bytes.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uint64_t>(file.gcount()) != size) return invalid_argument("cannot be read to its end");
  return bytes;
}

Result<Container> read_container(const std::filesystem::path& path) {
  RADBAKE_ASSIGN_OR_RETURN(std::string bytes, read_file(path, kMaxFileBytes));
  if (bytes.empty()) return invalid_argument("not a glTF: the file is empty");
  if (bytes.starts_with("glTF")) return split_chunks(bytes);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  if (first == std::string::npos || bytes[first] != '{') {
    return invalid_argument("not a glTF: it starts neither with the magic of a .glb nor with JSON");
  }
  return Container{std::move(bytes), {}};
}

}  // namespace radbake::gltf

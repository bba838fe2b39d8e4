// Clients that upload in parts, and a worker that sends a result in parts, against the stores that take them. Each byte
// is an operation, its operands follow.

#include <map>
#include <string>

#include "common/base/check.h"
#include "server/jobs/worker_run.h"
#include "server/store/content_store.h"
#include "tests/fuzz/byte_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/unit/store/temporary_folder.h"

namespace {

using namespace radbake;  // NOLINT(google-build-using-namespace)

constexpr std::uint64_t kMaxBlobBytes = 1000;
constexpr int kMaxOperations = 60;

/// What clients may upload: good bytes of several sizes, and digests that promise what no bytes keep.
struct KnownBlob {
  std::string bytes;
  Digest digest;
};

const std::vector<KnownBlob>& known_blobs() {
  static const std::vector<KnownBlob> blobs = [] {
    std::vector<KnownBlob> made;
    for (const std::size_t size : {0, 1, 100, 1000}) {
      const std::string bytes(size, static_cast<char>('a' + size % 7));
      made.push_back({bytes, digest_of(bytes)});
    }
    const std::string bytes(64, 'x');
    const Digest good = digest_of(bytes);
    made.push_back({bytes, {good.sha256, 10'000'000'000}});              // above the limit
    made.push_back({bytes, {good.sha256, 63}});                          // one byte short
    made.push_back({bytes, {std::string(64, '0'), 64}});                 // of other bytes
    made.push_back({bytes, {"../../etc/passwd", 64}});                   // a path
    made.push_back({bytes, {good.sha256.substr(0, 62) + "/.", 64}});     // a path of the right length
    made.push_back({bytes, {std::string(64, 'F'), ~std::uint64_t{0}}});  // upper case, a size that overflows
    return made;
  }();
  return blobs;
}

/// The store in a folder of its own and one worker's run, and what is known of them.
class Stores {
 public:
  Stores() { open(); }

  void apply(fuzz::ByteReader& input) {
    switch (input.byte() % 8) {
      case 0: return append(input);
      case 1: return finish(pick(input));
      case 2: return query(pick(input));
      case 3: return read(pick(input));
      case 4: return append_whole(pick(input));
      case 5: return send_part(input);
      case 6: return report_outcome(pick(input));
      default: return open();
    }
  }

  /// Whatever happened: what is there is what its digest says.
  void check_all() {
    for (const KnownBlob& blob : known_blobs()) read(blob);
  }

 private:
  static const KnownBlob& pick(fuzz::ByteReader& input) { return known_blobs()[input.byte() % known_blobs().size()]; }

  /// Opens the store anew, as after a crash: growing blobs are lost, complete ones are not.
  void open() {
    run_.reset();
    content_.reset();
    committed_.clear();
    auto opened = store::ContentStore::open(folder_.path(), {kMaxBlobBytes, 0});
    RADBAKE_CHECK(opened.ok());
    content_ = std::move(opened).value();
    jobs::RunEvents events;
    events.on_outcome = [](const jobs::WorkOutcome&) {};
    run_ = std::make_unique<jobs::WorkerRun>(jobs::WorkerRun::Assignment(), jobs::WorkerOptions(), *content_,
                                             std::move(events));
    offset_ = 0;
  }

  void append(fuzz::ByteReader& input) {
    const KnownBlob& blob = pick(input);
    const std::uint64_t offset = input.byte() == 255 ? ~std::uint64_t{0} - input.byte() : input.two_bytes() % 1100;
    const std::size_t size = input.two_bytes() % 1100;
    // Right bytes, or the same one off.
    std::string bytes(size, input.byte() % 4 == 0 ? 'w' : blob.bytes.empty() ? 'e' : blob.bytes[0]);
    const auto committed = content_->append_upload(blob.digest, offset, std::as_bytes(std::span(bytes)));
    if (!committed.ok()) return void(committed_.erase(blob.digest));
    RADBAKE_CHECK_LE(*committed, blob.digest.size_bytes);
    RADBAKE_CHECK_LE(committed_[blob.digest], *committed);
    committed_[blob.digest] = *committed;
  }

  void append_whole(const KnownBlob& blob) {
    (void)content_->append_upload(blob.digest, 0, std::as_bytes(std::span(blob.bytes)));
    (void)content_->finish_upload(blob.digest);
    committed_.erase(blob.digest);
  }

  void finish(const KnownBlob& blob) {
    const bool is_finished = content_->finish_upload(blob.digest).ok();
    RADBAKE_CHECK_EQ(is_finished, content_->contains(blob.digest));
    committed_.erase(blob.digest);
  }

  void query(const KnownBlob& blob) {
    const store::UploadProgress progress = content_->query_upload(blob.digest);
    RADBAKE_CHECK_EQ(progress.is_complete, content_->contains(blob.digest));
    if (progress.is_complete) RADBAKE_CHECK_EQ(progress.committed_bytes, blob.digest.size_bytes);
    RADBAKE_CHECK_LE(progress.committed_bytes, blob.digest.size_bytes);
  }

  void read(const KnownBlob& blob) {
    const auto bytes = content_->read_blob(blob.digest);
    RADBAKE_CHECK_EQ(bytes.ok(), content_->contains(blob.digest));
    if (!bytes.ok()) return;
    RADBAKE_CHECK(digest_of(*bytes) == blob.digest);
  }

  void send_part(fuzz::ByteReader& input) {
    const KnownBlob& blob = pick(input);
    const unsigned how = input.byte();
    const std::uint64_t offset = how & 1 ? input.two_bytes() : offset_;
    const std::string part = blob.bytes.substr(0, how & 2 ? input.two_bytes() : std::string::npos);
    std::optional<Digest> digest;
    if (how & 4) digest = blob.digest;
    const bool is_taken = run_->report_chunk({how & 8 ? "other" : "layer", offset, part, digest}).ok();
    offset_ = is_taken && !digest ? offset_ + part.size() : 0;
  }

  void report_outcome(const KnownBlob& blob) {
    run_->report_outcome({jobs::WorkOutcome::Kind::kSucceeded, "result", {}}, {blob.digest});
  }

  store::TemporaryFolder folder_;
  std::unique_ptr<store::ContentStore> content_;
  std::unique_ptr<jobs::WorkerRun> run_;
  std::uint64_t offset_ = 0;                   // of the result blob, if all parts were taken
  std::map<Digest, std::uint64_t> committed_;  // of uploads that nobody ended
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  fuzz::ByteReader input(bytes, size);
  Stores stores;
  for (int i = 0; i < kMaxOperations && !input.is_at_end(); ++i) stores.apply(input);
  stores.check_all();
  return 0;
}

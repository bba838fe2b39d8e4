#include "server/store/content_store.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <thread>

#include "server/store/failpoint.h"
#include "server/store/tenant_content.h"
#include "tests/unit/store/temporary_folder.h"

namespace radbake::store {
namespace {

constexpr std::uint64_t kMaxBlobBytes = 1 << 20;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

class ContentStoreTest : public ::testing::Test {
 protected:
  void SetUp() override { open(); }

  void open(std::uint64_t max_bytes = 0) {
    store_.reset();
    auto store = ContentStore::open(folder_.path(), {kMaxBlobBytes, max_bytes});
    ASSERT_TRUE(store.ok()) << store.error().message;
    store_ = std::move(store).value();
  }

  std::size_t num_temporaries() const {
    const std::filesystem::directory_iterator files(folder_.path() / "temporary");
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
  }

  Digest put(const std::string& text) {
    const Digest digest = digest_of(text);
    EXPECT_TRUE(store_->append_upload(digest, 0, bytes_of(text)).ok());
    EXPECT_TRUE(store_->finish_upload(digest).ok());
    return digest;
  }

  /// As if nobody had asked for it since.
  void age(const Digest& digest, std::chrono::hours by) {
    const auto file = folder_.path() / "objects" / digest.sha256.substr(0, 2) / digest.sha256;
    std::filesystem::last_write_time(file, std::filesystem::last_write_time(file) - by);
  }

  ErrorCode append_error(const Digest& digest, std::uint64_t offset, const std::string& text) {
    const auto appended = store_->append_upload(digest, offset, bytes_of(text));
    EXPECT_FALSE(appended.ok());
    return appended.ok() ? ErrorCode::kInternal : appended.error().code;
  }

  TemporaryFolder folder_;
  std::unique_ptr<ContentStore> store_;
  const std::string text_ = "some bytes of a mesh";
  const Digest digest_ = digest_of(text_);
};

TEST_F(ContentStoreTest, NamesABlobOnlyWhenItIsComplete) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_)).ok());
  EXPECT_FALSE(store_->contains(digest_));
  ASSERT_TRUE(store_->finish_upload(digest_).ok());
  EXPECT_TRUE(store_->contains(digest_));
  EXPECT_EQ(*store_->read_blob(digest_), text_);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "objects" / digest_.sha256.substr(0, 2) / digest_.sha256));
  EXPECT_EQ(num_temporaries(), 0u);
}

TEST_F(ContentStoreTest, RefusesBytesThatDoNotMatchTheirDigest) {
  std::string wrong = text_;
  wrong[3] ^= 1;
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(wrong)).ok());
  const auto finished = store_->finish_upload(digest_);
  ASSERT_FALSE(finished.ok());
  EXPECT_EQ(finished.error().code, ErrorCode::kDataLoss);
  EXPECT_FALSE(store_->contains(digest_));
  EXPECT_EQ(num_temporaries(), 0u);
  // The next upload starts from nothing and succeeds.
  EXPECT_EQ(store_->query_upload(digest_).committed_bytes, 0u);
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_)).ok());
  EXPECT_TRUE(store_->finish_upload(digest_).ok());
}

TEST_F(ContentStoreTest, RefusesTooFewAndTooManyBytes) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_.substr(1))).ok());
  EXPECT_EQ(store_->finish_upload(digest_).error().code, ErrorCode::kDataLoss);
  EXPECT_EQ(append_error(digest_, 0, text_ + "!"), ErrorCode::kDataLoss);
  EXPECT_EQ(num_temporaries(), 0u);
}

TEST_F(ContentStoreTest, GoesOnWhereAnUploadStopped) {
  EXPECT_EQ(*store_->append_upload(digest_, 0, bytes_of(text_.substr(0, 7))), 7u);
  EXPECT_EQ(store_->query_upload(digest_).committed_bytes, 7u);
  // What is there already is skipped.
  EXPECT_EQ(*store_->append_upload(digest_, 3, bytes_of(text_.substr(3, 2))), 7u);
  EXPECT_EQ(*store_->append_upload(digest_, 5, bytes_of(text_.substr(5))), text_.size());
  ASSERT_TRUE(store_->finish_upload(digest_).ok());
  EXPECT_TRUE(store_->query_upload(digest_).is_complete);
}

TEST_F(ContentStoreTest, RefusesAGap) { EXPECT_EQ(append_error(digest_, 4, "x"), ErrorCode::kFailedPrecondition); }

TEST_F(ContentStoreTest, AcceptsABlobThatIsThereWithoutItsBytes) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_)).ok());
  ASSERT_TRUE(store_->finish_upload(digest_).ok());
  EXPECT_EQ(*store_->append_upload(digest_, 0, {}), text_.size());
  EXPECT_TRUE(store_->finish_upload(digest_).ok());
  EXPECT_EQ(num_temporaries(), 0u);
}

TEST_F(ContentStoreTest, LetsManyUploadersShareOneBlob) {
  std::string text(200'000, 'a');
  for (std::size_t i = 0; i < text.size(); ++i) text[i] = static_cast<char>(i * 31 >> 3);
  const Digest digest = digest_of(text);
  std::vector<std::thread> uploaders;
  for (int uploader = 0; uploader < 4; ++uploader) {
    uploaders.emplace_back([&] {
      for (std::size_t offset = 0; offset < text.size(); offset += 1000) {
        EXPECT_TRUE(store_->append_upload(digest, offset, bytes_of(text.substr(offset, 1000))).ok());
      }
      EXPECT_TRUE(store_->finish_upload(digest).ok());
    });
  }
  for (std::thread& uploader : uploaders) uploader.join();
  EXPECT_EQ(*store_->read_blob(digest), text);
}

TEST_F(ContentStoreTest, ForgetsHalfBlobsAndKeepsWholeOnesAtAStart) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_)).ok());
  ASSERT_TRUE(store_->finish_upload(digest_).ok());
  // A server that was killed leaves this.
  std::ofstream(folder_.path() / "temporary" / "0") << "half a blob";
  open();
  EXPECT_EQ(num_temporaries(), 0u);
  EXPECT_EQ(*store_->read_blob(digest_), text_);
  const Digest other = digest_of(std::string("other"));
  ASSERT_TRUE(store_->append_upload(other, 0, bytes_of("other")).ok());
  EXPECT_TRUE(store_->finish_upload(other).ok());
}

TEST_F(ContentStoreTest, DoesNotTakeAFileOfAnotherSizeForTheBlob) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_)).ok());
  ASSERT_TRUE(store_->finish_upload(digest_).ok());
  std::filesystem::resize_file(folder_.path() / "objects" / digest_.sha256.substr(0, 2) / digest_.sha256, 5);
  EXPECT_FALSE(store_->contains(digest_));
  EXPECT_EQ(store_->open_blob(digest_).error().code, ErrorCode::kNotFound);
}

TEST_F(ContentStoreTest, RefusesNamesThatAreNotDigestsAndBlobsAboveTheLimit) {
  EXPECT_EQ(append_error({"../../etc/passwd", 3}, 0, "abc"), ErrorCode::kInvalidArgument);
  EXPECT_FALSE(store_->contains({"../lock", 0}));
  EXPECT_EQ(append_error({digest_.sha256, kMaxBlobBytes + 1}, 0, "abc"), ErrorCode::kResourceExhausted);
}

TEST_F(ContentStoreTest, NamesAResultWhenItsLastByteIsThere) {
  auto blob = store_->new_blob();
  ASSERT_TRUE(blob.ok());
  ASSERT_TRUE((*blob)->append(bytes_of(text_)).ok());
  ASSERT_TRUE(store_->commit(**blob, digest_).ok());
  EXPECT_EQ(*store_->read_blob(digest_), text_);
  {
    auto abandoned = store_->new_blob();
    ASSERT_TRUE((*abandoned)->append(bytes_of("x")).ok());
    EXPECT_EQ(num_temporaries(), 1u);
  }
  EXPECT_EQ(num_temporaries(), 0u);
}

TEST_F(ContentStoreTest, OpensBlobsForReadingOnly) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_)).ok());
  ASSERT_TRUE(store_->finish_upload(digest_).ok());
  auto file = store_->open_blob(digest_);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(fcntl(file->get(), F_GETFL) & O_ACCMODE, O_RDONLY);
  EXPECT_NE(fcntl(file->get(), F_GETFD) & FD_CLOEXEC, 0);
  EXPECT_EQ(*read_range(file->get(), 5, 5, "blob"), text_.substr(5, 5));
}

TEST_F(ContentStoreTest, GoesOnWithAnUploadThatAnEarlierServerBegan) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_.substr(0, 7))).ok());
  open();
  EXPECT_EQ(store_->query_upload(digest_).committed_bytes, 7u);
  EXPECT_EQ(store_->used_bytes(), text_.size());
  EXPECT_EQ(*store_->append_upload(digest_, 7, bytes_of(text_.substr(7))), text_.size());
  ASSERT_TRUE(store_->finish_upload(digest_).ok());
  EXPECT_EQ(*store_->read_blob(digest_), text_);
  EXPECT_EQ(num_temporaries(), 0u);
}

TEST_F(ContentStoreTest, FindsBytesThatAPowerLossChanged) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_.substr(0, 7))).ok());
  store_.reset();
  const std::filesystem::path file = std::filesystem::directory_iterator(folder_.path() / "temporary")->path();
  std::ofstream(file) << std::string(7, '\0');
  open();
  ASSERT_TRUE(store_->append_upload(digest_, 7, bytes_of(text_.substr(7))).ok());
  EXPECT_EQ(store_->finish_upload(digest_).error().code, ErrorCode::kDataLoss);
  EXPECT_EQ(store_->query_upload(digest_).committed_bytes, 0u);
}

TEST_F(ContentStoreTest, ClosesUploadsThatRestAndGoesOnWithThem) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_.substr(0, 7))).ok());
  store_->close_resting_uploads(std::chrono::steady_clock::now());
  EXPECT_EQ(num_temporaries(), 1u);
  EXPECT_EQ(store_->query_upload(digest_).committed_bytes, 7u);
  EXPECT_EQ(*store_->append_upload(digest_, 7, bytes_of(text_.substr(7))), text_.size());
  EXPECT_TRUE(store_->finish_upload(digest_).ok());
}

TEST_F(ContentStoreTest, RefusesWhatDoesNotFitWhenItsFirstBytesCome) {
  open(text_.size() + 4);
  put(text_);
  const std::string other = "other";
  EXPECT_EQ(append_error(digest_of(other), 0, other.substr(0, 1)), ErrorCode::kResourceExhausted);
  EXPECT_EQ(num_temporaries(), 0u);
  // Room is asked for once, and taken.
  age(digest_, std::chrono::hours(2));
  store_->set_make_room([&](std::uint64_t bytes) {
    EXPECT_EQ(bytes, 1u);
    store_->sweep({}, std::chrono::system_clock::now() - std::chrono::hours(1), bytes);
  });
  put(other);
  EXPECT_FALSE(store_->contains(digest_));
  EXPECT_EQ(store_->used_bytes(), other.size());
}

TEST_F(ContentStoreTest, CountsWhatUploadsReserve) {
  open(100);
  const Digest large{std::string(64, 'a'), 90};
  ASSERT_TRUE(store_->append_upload(large, 0, bytes_of("a")).ok());
  EXPECT_EQ(append_error(digest_, 0, text_), ErrorCode::kResourceExhausted);
  EXPECT_EQ(store_->finish_upload(large).error().code, ErrorCode::kDataLoss);  // given up: its room is free
  put(text_);
}

TEST_F(ContentStoreTest, SweepsTheOldestFirstAndNothingThatIsNeededOrWasAskedFor) {
  const Digest old = put("old"), older = put("older"), needed = put("needed"), asked_for = put("asked for"),
               young = put("young");
  for (const Digest& digest : {old, older, needed, asked_for}) age(digest, std::chrono::hours(10));
  age(older, std::chrono::hours(10));
  EXPECT_TRUE(store_->contains(asked_for));
  const auto before = std::chrono::system_clock::now() - std::chrono::hours(1);
  EXPECT_EQ(*store_->sweep({needed}, before, 1), older.size_bytes);
  EXPECT_TRUE(store_->contains(old));
  age(old, std::chrono::hours(10));
  EXPECT_EQ(*store_->sweep({needed}, before, 1000), old.size_bytes);
  for (const Digest& digest : {needed, asked_for, young}) EXPECT_TRUE(store_->contains(digest));
}

TEST_F(ContentStoreTest, SweepsUploadsThatNobodyGoesOnWith) {
  ASSERT_TRUE(store_->append_upload(digest_, 0, bytes_of(text_.substr(0, 7))).ok());
  const auto now = std::chrono::system_clock::now() + std::chrono::hours(1);
  EXPECT_EQ(*store_->sweep({}, now, 1000), 0u);  // somebody holds it open
  store_->close_resting_uploads(std::chrono::steady_clock::now());
  EXPECT_EQ(*store_->sweep({}, now, 1000), text_.size());
  EXPECT_EQ(num_temporaries(), 0u);
  EXPECT_EQ(store_->used_bytes(), 0u);
}

TEST(TenantContent, KeepsTheContentOfTenantsApart) {
  TemporaryFolder folder;
  auto content = std::move(TenantContent::open(folder.path(), {kMaxBlobBytes, 0})).value();
  ContentStore &own = **content->of(""), &first = **content->of("../first"), &second = **content->of("second");
  const std::string text = "a secret";
  const Digest digest = digest_of(text);
  ASSERT_TRUE(first.append_upload(digest, 0, bytes_of(text)).ok());
  EXPECT_EQ(second.query_upload(digest).committed_bytes, 0u);
  ASSERT_TRUE(first.finish_upload(digest).ok());
  EXPECT_FALSE(second.contains(digest));
  EXPECT_FALSE(own.contains(digest));
  EXPECT_EQ(&**content->of("../first"), &first);
  content = std::move(TenantContent::open(folder.path(), {kMaxBlobBytes, 0})).value();
  EXPECT_TRUE((*content->of("../first"))->contains(digest));
}

TEST_F(ContentStoreTest, KeepsResultsOfAnySizeAndRemovesThem) {
  const std::string result(kMaxBlobBytes + 1, 'r');
  auto writer = store_->new_blob();
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->append(std::as_bytes(std::span(result))).ok());
  ASSERT_TRUE(store_->commit(**writer, digest_of(result)).ok());
  EXPECT_EQ(store_->used_bytes(), result.size());
  store_->remove(digest_of(result));
  EXPECT_FALSE(store_->contains(digest_of(result)));
  EXPECT_EQ(store_->used_bytes(), 0u);
}

TEST_F(ContentStoreTest, TakesNoNameForKeptWhoseFolderIsNotForcedToTheDisk) {
  auto writer = store_->new_blob();
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->append(std::as_bytes(std::span(text_))).ok());
  static std::atomic<int> num_syncs;
  num_syncs = 0;
  // The shelf's folder, the blob, and then the shelf.
  fault_hook = [](const char* operation) { return std::string(operation) == "sync" && ++num_syncs == 3 ? EIO : 0; };
  const auto committed = store_->commit(**writer, digest_of(text_));
  fault_hook = nullptr;
  EXPECT_FALSE(committed.ok());
  EXPECT_FALSE(store_->contains(digest_of(text_)));
  EXPECT_EQ(store_->used_bytes(), 0u);
}

}  // namespace
}  // namespace radbake::store

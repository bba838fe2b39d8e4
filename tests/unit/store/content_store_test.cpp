#include "server/store/content_store.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "tests/unit/store/temporary_folder.h"

namespace radbake::store {
namespace {

constexpr std::uint64_t kMaxBlobBytes = 1 << 20;

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

class ContentStoreTest : public ::testing::Test {
 protected:
  void SetUp() override { open(); }

  void open() {
    store_.reset();
    auto store = ContentStore::open(folder_.path(), kMaxBlobBytes);
    ASSERT_TRUE(store.ok()) << store.error().message;
    store_ = std::move(store).value();
  }

  std::size_t num_temporaries() const {
    const std::filesystem::directory_iterator files(folder_.path() / "temporary");
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
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

}  // namespace
}  // namespace radbake::store

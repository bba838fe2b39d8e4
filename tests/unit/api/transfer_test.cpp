#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/api/client.h"
#include "tests/unit/api/fake_server.h"
#include "tests/unit/api/impatient.h"

namespace radbake::api {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class Transfer : public testing::Test {
 protected:
  void SetUp() override {
    Result<Client> connected = Client::connect(server_.address(), impatient());
    ASSERT_TRUE(connected.ok()) << connected.error().message;
    client_ = std::make_unique<Client>(std::move(connected).value());
  }

  /// Keeps the bytes alive.
  BlobView blob(std::string bytes) {
    kept_.push_back(std::make_unique<std::string>(std::move(bytes)));
    return {digest_of(*kept_.back()), *kept_.back()};
  }

  static std::string some_bytes(std::size_t size) {
    std::string bytes(size, '\0');
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * i % 251);
    return bytes;
  }

  FakeServer server_;
  std::unique_ptr<Client> client_;
  std::vector<std::unique_ptr<std::string>> kept_;
};

TEST_F(Transfer, UploadsWhatIsMissingAndNothingElse) {
  const std::vector<BlobView> blobs = {blob("known"), blob("new"), blob("")};
  server_.blobs[blobs[0].digest.sha256] = "known";
  const Result<std::uint64_t> sent = client_->upload_missing(blobs);
  ASSERT_TRUE(sent.ok()) << sent.error().message;
  EXPECT_EQ(*sent, 3u);
  EXPECT_THAT(server_.blobs, SizeIs(3));
  EXPECT_THAT(server_.upload_offsets, SizeIs(2));
  EXPECT_EQ(*client_->upload_missing(blobs), 0u);
  EXPECT_THAT(server_.upload_offsets, SizeIs(2));
}

TEST_F(Transfer, AsksForNoMoreDigestsACallThanTheServerTakes) {
  std::vector<BlobView> blobs;
  for (int i = 0; i < 7; ++i) blobs.push_back(blob("blob " + std::to_string(i)));
  ASSERT_TRUE(client_->upload_missing(blobs).ok());
  EXPECT_THAT(server_.find_missing_sizes, ElementsAre(3u, 3u, 1u));
  EXPECT_THAT(server_.blobs, SizeIs(7));
}

TEST_F(Transfer, WaitsForNoAnswerThatAnOlderServerDoesNotGive) {
  FakeServer older;
  older.capabilities.set_protocol_minor(0);
  Result<Client> client = Client::connect(older.address(), impatient());
  ASSERT_TRUE(client.ok()) << client.error().message;
  const std::vector<BlobView> blobs = {blob(some_bytes(5000))};
  const Result<std::uint64_t> sent = client->upload_missing(blobs);
  ASSERT_TRUE(sent.ok()) << sent.error().message;
  EXPECT_EQ(older.blobs[blobs[0].digest.sha256], *kept_[0]);
}

TEST_F(Transfer, ResumesABrokenUploadWhereItEnded) {
  server_.break_uploads_at = 2500;
  const std::vector<BlobView> blobs = {blob(some_bytes(5000))};
  ASSERT_TRUE(client_->upload_missing(blobs).ok());
  EXPECT_THAT(server_.upload_offsets, ElementsAre(0u, 3000u));
  EXPECT_EQ(server_.blobs[blobs[0].digest.sha256], *kept_[0]);
}

TEST_F(Transfer, StartsAnUploadAgainThatTheServerForgot) {
  server_.break_uploads_at = 2500;
  server_.forget_broken_uploads = true;
  const std::vector<BlobView> blobs = {blob(some_bytes(5000))};
  ASSERT_TRUE(client_->upload_missing(blobs).ok());
  EXPECT_THAT(server_.upload_offsets, ElementsAre(0u, 0u));
}

TEST_F(Transfer, TellsUploadProgressUpToTheTotal) {
  const std::vector<BlobView> blobs = {blob(some_bytes(2500)), blob("small")};
  std::vector<std::uint64_t> done;
  ASSERT_TRUE(client_
                  ->upload_missing(blobs,
                                   [&](std::uint64_t bytes, std::uint64_t total) {
                                     EXPECT_EQ(total, 2505u);
                                     done.push_back(bytes);
                                   })
                  .ok());
  EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
  EXPECT_EQ(done.back(), 2505u);
}

TEST_F(Transfer, ReportsBytesThatDoNotMatchTheirDigest) {
  BlobView wrong = blob("these bytes");
  wrong.bytes = "those bytes";
  const std::vector<BlobView> blobs = {wrong};
  const Result<std::uint64_t> sent = client_->upload_missing(blobs);
  ASSERT_FALSE(sent.ok());
  EXPECT_EQ(sent.error().code, ErrorCode::kDataLoss);
}

TEST_F(Transfer, StopsAnUploadWhenAsked) {
  std::stop_source stop;
  const std::vector<BlobView> blobs = {blob(some_bytes(50000))};
  const Result<std::uint64_t> sent = client_->upload_missing(
      blobs, [&](std::uint64_t, std::uint64_t) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(sent.ok());
  EXPECT_EQ(sent.error().code, ErrorCode::kCancelled);
  EXPECT_THAT(server_.blobs, IsEmpty());
}

TEST_F(Transfer, DownloadsABlobOverManyBreaks) {
  const std::string bytes = some_bytes(4500);
  const Digest digest = digest_of(bytes);
  server_.blobs[digest.sha256] = bytes;
  server_.break_downloads_after = 2000;
  const Result<std::string> received = client_->download(digest);
  ASSERT_TRUE(received.ok()) << received.error().message;
  EXPECT_EQ(*received, bytes);
  EXPECT_THAT(server_.download_offsets, ElementsAre(0u, 2000u, 4000u));
}

TEST_F(Transfer, RefusesADownloadOfOtherBytes) {
  const std::string bytes = some_bytes(4500);
  const Digest digest = digest_of(bytes);
  server_.blobs[digest.sha256] = bytes;
  server_.blobs[digest.sha256][4321] ^= 1;
  const Result<std::string> received = client_->download(digest);
  ASSERT_FALSE(received.ok());
  EXPECT_EQ(received.error().code, ErrorCode::kDataLoss);
  EXPECT_THAT(received.error().message, HasSubstr(digest.sha256));
}

TEST_F(Transfer, RefusesADownloadThatDoesNotEnd) {
  const Digest digest = digest_of(some_bytes(1500));
  server_.blobs[digest.sha256] = some_bytes(100000);
  const Result<std::string> received = client_->download(digest);
  ASSERT_FALSE(received.ok());
  EXPECT_EQ(received.error().code, ErrorCode::kDataLoss);
  EXPECT_THAT(received.error().message, HasSubstr("more bytes"));
}

}  // namespace
}  // namespace radbake::api

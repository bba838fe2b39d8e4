#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "google/rpc/error_details.pb.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

/// The limit that a refusal names.
std::string limit_of(const grpc::Status& status) {
  const auto quota = detail_of<google::rpc::QuotaFailure>(status);
  return quota ? quota->violations(0).subject() : "";
}

class ContentServiceTest : public ::testing::Test {
 protected:
  std::string download(const std::string& bytes, std::uint64_t offset, std::uint64_t limit) {
    v1::DownloadRequest request;
    *request.mutable_digest() = digest_message(bytes);
    request.set_offset(offset);
    request.set_limit(limit);
    const auto context = new_context();
    const auto stream = client_.content->Download(context.get(), request);
    std::string received;
    v1::DownloadChunk chunk;
    while (stream->Read(&chunk)) {
      EXPECT_EQ(chunk.offset(), offset + received.size());
      received += chunk.data();
    }
    EXPECT_TRUE(stream->Finish().ok());
    return received;
  }

  v1::QueryUploadResponse query(const std::string& bytes) {
    v1::QueryUploadRequest request;
    *request.mutable_digest() = digest_message(bytes);
    v1::QueryUploadResponse response;
    EXPECT_TRUE(client_.content->QueryUpload(new_context().get(), request, &response).ok());
    return response;
  }

  /// Sends the first bytes of a blob and then leaves.
  void upload_part(const std::string& bytes, std::size_t size) {
    const auto context = new_context();
    const auto stream = client_.content->Upload(context.get());
    v1::UploadChunk chunk;
    *chunk.mutable_digest() = digest_message(bytes);
    chunk.set_data(bytes.substr(0, size));
    stream->Write(chunk);
    EXPECT_EQ(finish_upload(*stream).error_code(), grpc::INVALID_ARGUMENT);
  }

  TemporaryFolder folder_;
  TestServer server_{TestServer::options_in(folder_.path())};
  TestClient client_ = server_.client();
  const std::string blob_ = [] {
    std::string bytes(400'000, '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i >> 7);
    return bytes;
  }();
};

TEST_F(ContentServiceTest, GivesBackWhatWasUploadedInChunks) {
  v1::UploadResult result;
  ASSERT_TRUE(client_.upload(blob_, &result, 100'000).ok());
  EXPECT_EQ(result.committed_bytes(), blob_.size());
  EXPECT_FALSE(result.already_present());
  EXPECT_EQ(download(blob_, 0, 0), blob_);
  EXPECT_EQ(download(blob_, 1234, 150'000), blob_.substr(1234, 150'000));
  EXPECT_EQ(download(blob_, blob_.size(), 0), "");
}

TEST_F(ContentServiceTest, StoresAnEmptyBlob) {
  ASSERT_TRUE(client_.upload("").ok());
  EXPECT_TRUE(query("").complete());
}

TEST_F(ContentServiceTest, EndsAnUploadEarlyWhenTheBlobIsThere) {
  ASSERT_TRUE(client_.upload(blob_).ok());
  v1::UploadResult result;
  ASSERT_TRUE(client_.upload(blob_, &result).ok());
  EXPECT_TRUE(result.already_present());
  EXPECT_EQ(result.committed_bytes(), blob_.size());
}

TEST_F(ContentServiceTest, ResumesAnInterruptedUpload) {
  upload_part(blob_, 70'000);
  EXPECT_EQ(query(blob_).committed_bytes(), 70'000u);
  EXPECT_FALSE(query(blob_).complete());
  ASSERT_TRUE(client_.upload(blob_, nullptr, 100'000, 70'000).ok());
  EXPECT_TRUE(query(blob_).complete());
  EXPECT_EQ(download(blob_, 0, 0), blob_);
}

TEST_F(ContentServiceTest, RefusesBytesThatDoNotMatchTheirDigest) {
  const auto context = new_context();
  const auto stream = client_.content->Upload(context.get());
  v1::UploadChunk chunk;
  *chunk.mutable_digest() = digest_message("right");
  chunk.set_data("wrong");
  chunk.set_finish(true);
  stream->Write(chunk);
  EXPECT_EQ(finish_upload(*stream).error_code(), grpc::DATA_LOSS);
  EXPECT_EQ(query("right").committed_bytes(), 0u);
  EXPECT_TRUE(client_.upload("right").ok());
}

TEST_F(ContentServiceTest, TellsHowFarAnUploadIsWhereItIsAsked) {
  const auto context = new_context();
  const auto stream = client_.content->Upload(context.get());
  v1::UploadChunk chunk;
  v1::UploadResult result;
  *chunk.mutable_digest() = digest_message("in two parts");
  chunk.set_wants_progress(true);
  chunk.set_data("in two");
  ASSERT_TRUE(stream->Write(chunk));
  ASSERT_TRUE(stream->Read(&result));
  EXPECT_EQ(result.committed_bytes(), 6u);
  EXPECT_EQ(query("in two parts").committed_bytes(), 6u);
  chunk.Clear();
  chunk.set_offset(6);
  chunk.set_data(" parts");
  chunk.set_finish(true);
  ASSERT_TRUE(stream->Write(chunk));
  ASSERT_TRUE(stream->Read(&result));
  EXPECT_EQ(result.committed_bytes(), 12u);
  EXPECT_TRUE(finish_upload(*stream).ok());
  EXPECT_TRUE(query("in two parts").complete());
}

TEST_F(ContentServiceTest, RefusesAGapAsOutOfRange) {
  const grpc::Status status = client_.upload(blob_, nullptr, 1000, 5000);
  EXPECT_EQ(status.error_code(), grpc::OUT_OF_RANGE);
  EXPECT_THAT(status.error_message(), ::testing::HasSubstr("5000"));
}

TEST_F(ContentServiceTest, NamesTheLimitThatAChunkIsAbove) {
  const grpc::Status status = client_.upload(blob_, nullptr, 200'000);
  EXPECT_EQ(status.error_code(), grpc::RESOURCE_EXHAUSTED);
  const auto quota = detail_of<google::rpc::QuotaFailure>(status);
  ASSERT_TRUE(quota.has_value());
  EXPECT_EQ(quota->violations(0).subject(), "chunk_bytes");
  EXPECT_THAT(quota->violations(0).description(), ::testing::HasSubstr("200000"));
}

TEST_F(ContentServiceTest, RefusesABlobAboveTheLimitBeforeItsFirstByte) {
  const auto context = new_context();
  const auto stream = client_.content->Upload(context.get());
  v1::UploadChunk chunk;
  *chunk.mutable_digest() = digest_message("huge");
  chunk.mutable_digest()->set_size_bytes(std::uint64_t{1} << 40);
  chunk.set_data("h");
  stream->Write(chunk);
  const grpc::Status status = finish_upload(*stream);
  EXPECT_EQ(status.error_code(), grpc::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), ::testing::HasSubstr("max_blob_bytes"));
  EXPECT_EQ(limit_of(status), "max_blob_bytes");
}

TEST_F(ContentServiceTest, NamesTheLimitThatABlobDoesNotFitInto) {
  TemporaryFolder folder;
  service::BakeServerOptions options = TestServer::options_in(folder.path());
  options.limits.max_content_bytes = 1000;
  TestServer server(options);
  EXPECT_EQ(limit_of(server.client().upload(blob_)), "max_content_bytes");
}

TEST_F(ContentServiceTest, RefusesANameThatIsNotADigest) {
  v1::DownloadRequest request;
  request.mutable_digest()->set_sha256("../../lock");
  const auto context = new_context();
  const auto stream = client_.content->Download(context.get(), request);
  v1::DownloadChunk chunk;
  EXPECT_FALSE(stream->Read(&chunk));
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
  const auto bad = detail_of<google::rpc::BadRequest>(status);
  ASSERT_TRUE(bad.has_value());
  EXPECT_EQ(bad->field_violations(0).field(), "digest");
}

TEST_F(ContentServiceTest, FindsWhatIsMissingInTheOrderOfTheRequest) {
  ASSERT_TRUE(client_.upload("b").ok());
  v1::FindMissingRequest request;
  for (const char* bytes : {"c", "b", "a"}) *request.add_digests() = digest_message(bytes);
  v1::FindMissingResponse response;
  ASSERT_TRUE(client_.content->FindMissing(new_context().get(), request, &response).ok());
  ASSERT_EQ(response.missing_size(), 2);
  EXPECT_EQ(response.missing(0).sha256(), digest_message("c").sha256());
  EXPECT_EQ(response.missing(1).sha256(), digest_message("a").sha256());

  for (int i = 0; i < 1000; ++i) *request.add_digests() = digest_message("a");
  EXPECT_EQ(client_.content->FindMissing(new_context().get(), request, &response).error_code(),
            grpc::RESOURCE_EXHAUSTED);
}

TEST_F(ContentServiceTest, RefusesAnotherProtocolNamingBothVersions) {
  v1::QueryUploadRequest request;
  *request.mutable_digest() = digest_message("a");
  v1::QueryUploadResponse response;
  const grpc::Status status = client_.content->QueryUpload(new_context("99").get(), request, &response);
  EXPECT_EQ(status.error_code(), grpc::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), ::testing::AllOf(::testing::HasSubstr("99"), ::testing::HasSubstr("protocol 1")));
  // A client that does not say is taken for one of ours.
  EXPECT_TRUE(client_.content->QueryUpload(new_context("").get(), request, &response).ok());
}

}  // namespace
}  // namespace radbake::testing

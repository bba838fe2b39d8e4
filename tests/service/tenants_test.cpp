// What a tenant can learn of another: nothing, through any call.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/digest.h"
#include "google/rpc/error_details.pb.h"
#include "tests/service/test_certificates.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

const std::string kAcme = "acme's.token.which.is.long.enough";
const std::string kZeta = "zeta's.token.which.is.long.enough";
const std::string kBoss = "the.operator's.token.which.is.long.enough";

class TenantsTest : public ::testing::Test {
 protected:
  TenantsTest() {
    service::BakeServerOptions options = TestServer::options_in(folder_.path());
    options.access.tokens = folder_.path() / "tokens";
    const auto line = [](const std::string& token, const char* rest) { return digest_of(token).sha256 + rest; };
    replace_file(options.access.tokens,
                 line(kAcme, " acme submit\n") + line(kZeta, " zeta submit\n") + line(kBoss, " ops admin\n"));
    server_ = std::make_unique<TestServer>(options);
    acme_ = std::make_unique<TestClient>(server_->client(kAcme));
    zeta_ = std::make_unique<TestClient>(server_->client(kZeta));
    boss_ = std::make_unique<TestClient>(server_->client(kBoss));
  }

  static std::vector<std::string> names_of(const TestClient& client) {
    v1::ListBakesRequest request;
    request.set_page_size(1);
    std::vector<std::string> names;
    do {
      v1::ListBakesResponse page;
      EXPECT_TRUE(client.bakes->ListBakes(new_context().get(), request, &page).ok());
      for (const v1::Bake& bake : page.bakes()) names.push_back(bake.name());
      request.set_page_token(page.next_page_token());
    } while (!request.page_token().empty());
    return names;
  }

  static grpc::Status get(const TestClient& client, const std::string& name) {
    v1::GetBakeRequest request;
    request.set_name(name);
    v1::Bake bake;
    return client.bakes->GetBake(new_context().get(), request, &bake);
  }

  static bool is_missing(const TestClient& client, const v1::Digest& digest) {
    v1::FindMissingRequest request;
    *request.add_digests() = digest;
    v1::FindMissingResponse response;
    EXPECT_TRUE(client.content->FindMissing(new_context().get(), request, &response).ok());
    return response.missing_size() == 1;
  }

  static grpc::Status download(const TestClient& client, const v1::Digest& digest) {
    v1::DownloadRequest request;
    *request.mutable_digest() = digest;
    const auto context = new_context();
    const auto stream = client.content->Download(context.get(), request);
    v1::DownloadChunk chunk;
    while (stream->Read(&chunk)) continue;
    return stream->Finish();
  }

  TemporaryFolder folder_;
  std::unique_ptr<TestServer> server_;
  std::unique_ptr<TestClient> acme_, zeta_, boss_;
};

TEST_F(TenantsTest, FindNoJobOfAnotherByItsName) {
  const std::string theirs = acme_->submit(kRunUntilCancelled).name();
  const std::string nobodys = "bakes/0123456789abcdef";
  // Each answer is that for a job that does not exist, but for the name.
  const auto expect_unknown = [&](const auto& ask) {
    const grpc::Status other = ask(theirs), none = ask(nobodys);
    EXPECT_EQ(other.error_code(), grpc::NOT_FOUND);
    EXPECT_EQ(none.error_code(), grpc::NOT_FOUND);
    EXPECT_EQ(other.error_details(), none.error_details());
    std::string message = other.error_message();
    const std::size_t at = message.find(theirs);
    ASSERT_NE(at, std::string::npos) << message;
    EXPECT_EQ(message.replace(at, theirs.size(), nobodys), none.error_message());
  };
  expect_unknown([&](const std::string& name) { return get(*zeta_, name); });
  expect_unknown([&](const std::string& name) { return zeta_->cancel(name); });
  expect_unknown([&](const std::string& name) { return zeta_->finish(name); });
  expect_unknown([&](const std::string& name) { return zeta_->watch(name).status; });
  EXPECT_LT(acme_->get(theirs).state(), v1::SUCCEEDED) << "what zeta asked for has reached the job";
  EXPECT_TRUE(acme_->cancel(theirs).ok());
  EXPECT_EQ(acme_->watch(theirs).finished().state(), v1::CANCELLED);
}

TEST_F(TenantsTest, ListTheirOwnJobsPageByPage) {
  const std::string a1 = acme_->submit(kSucceed).name(), z1 = zeta_->submit(kSucceed).name(),
                    a2 = acme_->submit(kFailBadScene).name();
  EXPECT_THAT(names_of(*acme_), ::testing::ElementsAre(a2, a1));
  EXPECT_THAT(names_of(*zeta_), ::testing::ElementsAre(z1));
}

TEST_F(TenantsTest, CannotTellWhichBlobsAnotherHas) {
  const std::string bytes(5000, 's');
  const v1::Digest digest = digest_message(bytes);
  ASSERT_TRUE(acme_->upload(bytes).ok());
  EXPECT_FALSE(is_missing(*acme_, digest));

  EXPECT_TRUE(is_missing(*zeta_, digest));
  EXPECT_EQ(download(*zeta_, digest).error_code(), grpc::NOT_FOUND);
  EXPECT_EQ(download(*boss_, digest).error_code(), grpc::NOT_FOUND);
  v1::QueryUploadRequest query;
  *query.mutable_digest() = digest;
  v1::QueryUploadResponse answer;
  ASSERT_TRUE(zeta_->content->QueryUpload(new_context().get(), query, &answer).ok());
  EXPECT_FALSE(answer.complete());
  EXPECT_EQ(answer.committed_bytes(), 0u);
  // Nor does an upload end early: who has not got the bytes does not get the blob by its name.
  v1::UploadResult result;
  ASSERT_TRUE(zeta_->upload(bytes, &result).ok());
  EXPECT_FALSE(result.already_present());
  ASSERT_TRUE(zeta_->upload(bytes, &result).ok());
  EXPECT_TRUE(result.already_present());
}

TEST_F(TenantsTest, CannotTellHowFarAnothersUploadIs) {
  const std::string bytes(5000, 'u');
  const auto context = new_context();
  const auto stream = acme_->content->Upload(context.get());
  v1::UploadChunk chunk;
  *chunk.mutable_digest() = digest_message(bytes);
  chunk.set_data(bytes.substr(0, 2000));
  stream->Write(chunk);
  EXPECT_EQ(finish_upload(*stream).error_code(), grpc::INVALID_ARGUMENT);
  v1::QueryUploadRequest query;
  *query.mutable_digest() = digest_message(bytes);
  v1::QueryUploadResponse answer;
  ASSERT_TRUE(acme_->content->QueryUpload(new_context().get(), query, &answer).ok());
  EXPECT_EQ(answer.committed_bytes(), 2000u);
  ASSERT_TRUE(zeta_->content->QueryUpload(new_context().get(), query, &answer).ok());
  EXPECT_EQ(answer.committed_bytes(), 0u);
  // Going on where another one is would show that he is there.
  EXPECT_EQ(zeta_->upload(bytes, nullptr, 1000, 2000).error_code(), grpc::OUT_OF_RANGE);
}

TEST_F(TenantsTest, CannotBakeWithTheBlobsOfAnother) {
  const v1::Digest manifest = acme_->upload_scene();
  const v1::SubmitBakeRequest request = zeta_->request_for(manifest, kSucceed);
  v1::Bake bake;
  const grpc::Status status = zeta_->bakes->SubmitBake(new_context().get(), request, &bake);
  EXPECT_EQ(status.error_code(), grpc::FAILED_PRECONDITION);
  auto missing = detail_of<google::rpc::PreconditionFailure>(status);
  ASSERT_TRUE(missing.has_value());
  EXPECT_EQ(missing->violations(0).type(), "MISSING");
  v1::PlanBakeRequest plan_request;
  *plan_request.mutable_manifest() = manifest;
  v1::Plan plan;
  EXPECT_EQ(zeta_->bakes->PlanBake(new_context().get(), plan_request, &plan).error_code(), grpc::FAILED_PRECONDITION);
  // The manifest alone does not help: what it names is still missing, the mesh that acme has.
  v1::SceneManifest scene;
  scene.add_meshes()->set_name("box");
  *scene.mutable_meshes(0)->mutable_blob() = digest_message(std::string(5000, 'm'));
  scene.mutable_meshes(0)->set_num_vertices(8);
  scene.mutable_meshes(0)->set_num_triangles(12);
  scene.add_materials()->set_name("white");
  ASSERT_EQ(digest_message(scene.SerializeAsString()).sha256(), manifest.sha256());
  ASSERT_TRUE(zeta_->upload(scene.SerializeAsString()).ok());
  const grpc::Status again = zeta_->bakes->SubmitBake(new_context().get(), request, &bake);
  missing = detail_of<google::rpc::PreconditionFailure>(again);
  ASSERT_TRUE(missing.has_value());
  EXPECT_THAT(missing->violations(0).subject(), ::testing::HasSubstr(scene.meshes(0).blob().sha256()));
}

TEST_F(TenantsTest, MayUseTheSameRequestIdAndScene) {
  const v1::SubmitBakeRequest request = acme_->request_for(acme_->upload_scene(), kSucceed);
  v1::Bake theirs, ours;
  ASSERT_TRUE(acme_->bakes->SubmitBake(new_context().get(), request, &theirs).ok());
  ASSERT_EQ(acme_->watch(theirs.name()).finished().state(), v1::SUCCEEDED);

  zeta_->upload_scene();
  v1::SubmitBakeRequest other_body = request;
  other_body.set_label("zeta's");
  // No ALREADY_EXISTS, and no result of an earlier bake that zeta did not make.
  const grpc::Status status = zeta_->bakes->SubmitBake(new_context().get(), other_body, &ours);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_NE(ours.name(), theirs.name());
  EXPECT_FALSE(ours.from_store());
  const v1::Bake finished = zeta_->watch(ours.name()).finished();
  ASSERT_EQ(finished.state(), v1::SUCCEEDED);
  EXPECT_TRUE(download(*zeta_, finished.result().layers(0).blob()).ok());
}

TEST_F(TenantsTest, ShareNoRun) {
  const v1::SubmitBakeRequest request = acme_->request_for(acme_->upload_scene(), kRunUntilCancelled);
  v1::Bake theirs, ours;
  ASSERT_TRUE(acme_->bakes->SubmitBake(new_context().get(), request, &theirs).ok());
  zeta_->upload_scene();
  ASSERT_TRUE(zeta_->bakes->SubmitBake(new_context().get(), request, &ours).ok());
  EXPECT_EQ(zeta_->get(ours.name()).shares(), "");
  ASSERT_TRUE(acme_->cancel(theirs.name()).ok());
  EXPECT_EQ(acme_->watch(theirs.name()).finished().state(), v1::CANCELLED);
  EXPECT_NE(zeta_->wait_for(ours.name(), v1::FORM_FACTORS).state(), v1::CANCELLED);
  EXPECT_TRUE(zeta_->cancel(ours.name()).ok());
}

TEST_F(TenantsTest, AreAllSeenByAnAdmin) {
  const std::string theirs = acme_->submit(kRunUntilCancelled).name(), ours = boss_->submit(kSucceed).name();
  EXPECT_THAT(names_of(*boss_), ::testing::ElementsAre(ours, theirs));
  EXPECT_TRUE(get(*boss_, theirs).ok());
  EXPECT_TRUE(boss_->finish(theirs).ok());
  EXPECT_EQ(boss_->watch(theirs).finished().state(), v1::SUCCEEDED);
  EXPECT_TRUE(boss_->cancel(theirs).ok());
  EXPECT_THAT(names_of(*acme_), ::testing::ElementsAre(theirs));
  EXPECT_EQ(get(*acme_, ours).error_code(), grpc::NOT_FOUND);
}

}  // namespace
}  // namespace radbake::testing

// What strangers send to the real server and its real workers: each attack has its error, the server's memory stays
// below a bound, and what a worker tries that it may not ends the worker alone.

#include <gmock/gmock.h>
#include <google/protobuf/stubs/logging.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

#include "common/base/limits.h"
#include "radbake/v1/scene.pb.h"
#include "server/worker/sandbox.h"
#include "tests/fuzz/attacks.h"
#include "tests/service/server_program.h"
#include "tests/service/test_server.h"
#include "tests/unit/codec/codec_scenes.h"

namespace radbake::testing {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

/// The most that the server may hold while one stranger tries. Idle it holds some 20 MiB; a manifest of 1 MiB is the
/// largest thing that it ever parses, and becomes at most some 30 MB of objects.
constexpr std::uint64_t kMostServerBytes = std::uint64_t{96} << 20;

/// What the kernel says in /proc/PID/status, in KiB.
std::uint64_t status_of(pid_t pid, const std::string& key) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key + ":")) return std::stoull(line.substr(key.size() + 1));
  }
  ADD_FAILURE() << "no " << key << " of process " << pid;
  return 0;
}

/// A small scene that bakes.
Scene good_scene() {
  Scene scene = sheet_scene(2);
  scene.materials.resize(1);
  scene.materials[0] = Material();
  scene.materials[0].reflectance = {0.5, 0.5, 0.5};
  scene.textures.clear();
  return scene;
}

/// A request of raw bytes, as no client of ours would send it.
grpc::Status call_raw(TestClient& client, const std::string& method, const std::string& bytes,
                      grpc_compression_algorithm compression = GRPC_COMPRESS_NONE) {
  grpc::GenericStub stub(client.channel);
  const auto context = new_context();
  context->set_compression_algorithm(compression);
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer request(&slice, 1);
  grpc::ByteBuffer response;
  grpc::CompletionQueue queue;
  const auto call = stub.PrepareUnaryCall(context.get(), method, request, &queue);
  grpc::Status status;
  call->StartCall();
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  EXPECT_TRUE(queue.Next(&tag, &ok));
  return status;
}

/// radbaked and radbake-worker as they are installed.
class HostileTest : public ::testing::Test {
 protected:
  HostileTest()
      : program_({"--listen", "unix:" + (folder_.path() / "socket").string(), "--data",
                  (folder_.path() / "data").string(), "--worker", RADBAKE_WORKER}),
        client_(program_.wait_for_address()) {}

  /// Whatever was sent: the server lives, has answered, and took little memory.
  void TearDown() override {
    v1::Capabilities capabilities;
    EXPECT_TRUE(client_.server->GetCapabilities(new_context().get(), {}, &capabilities).ok());
    const std::uint64_t peak = status_of(program_.pid(), "VmHWM") * 1024;
    RecordProperty("server_peak_mib", static_cast<int>(peak >> 20));
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which keep what was freed
    EXPECT_LT(peak, kMostServerBytes);
#endif
  }

  grpc::Status submit_manifest(const std::string& manifest, v1::Bake* bake = nullptr) {
    const grpc::Status uploaded = client_.upload(manifest, nullptr, Limits{}.chunk_bytes);
    EXPECT_TRUE(uploaded.ok()) << uploaded.error_message();
    v1::Bake own_bake;
    return client_.bakes->SubmitBake(new_context().get(), client_.request_for(digest_message(manifest), kSucceed, 0),
                                     bake ? bake : &own_bake);
  }

  /// How the bake of one mesh ends whose record vouches for these numbers.
  v1::Bake bake_mesh(const std::string& blob, std::uint32_t num_triangles, const std::string& name = "wall") {
    EXPECT_TRUE(client_.upload(blob).ok());
    v1::SceneManifest manifest;
    v1::MeshRecord& mesh = *manifest.add_meshes();
    mesh.set_name(name);
    *mesh.mutable_blob() = digest_message(blob);
    mesh.set_num_vertices(4);
    mesh.set_num_triangles(num_triangles);
    manifest.add_materials()->set_name("white");
    v1::Bake bake;
    const grpc::Status status = submit_manifest(manifest.SerializeAsString(), &bake);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return client_.watch(bake.name()).finished();
  }

  /// Uploads a good scene with a changed manifest and submits it.
  grpc::Status submit_changed(const std::function<void(v1::SceneManifest&)>& change) {
    const EncodedScene scene = *encode_scene(sheet_scene(2), {});
    for (const EncodedBlob& blob : scene.blobs) EXPECT_TRUE(client_.upload(blob.bytes).ok());
    v1::SceneManifest manifest;
    EXPECT_TRUE(manifest.ParseFromString(scene.blobs.back().bytes));
    change(manifest);
    return submit_manifest(manifest.SerializeAsString());
  }

  void expect_refused(const grpc::Status& status, grpc::StatusCode code, const std::string& message) {
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(message));
  }
  void expect_failed(const v1::Bake& bake, grpc::StatusCode code, const std::string& message) {
    EXPECT_EQ(bake.state(), v1::FAILED);
    EXPECT_EQ(bake.error().code(), code);
    EXPECT_THAT(bake.error().message(), HasSubstr(message));
  }

  TemporaryFolder folder_;
  ServerProgram program_;
  TestClient client_;
};

TEST_F(HostileTest, BakesAScene) {
  // All the refusals below are of attacks, not of whatever comes.
  const EncodedScene scene = *encode_scene(good_scene(), {});
  for (const EncodedBlob& blob : scene.blobs) EXPECT_TRUE(client_.upload(blob.bytes).ok());
  v1::Bake bake;
  ASSERT_TRUE(submit_manifest(scene.blobs.back().bytes, &bake).ok());
  const v1::Bake finished = client_.watch(bake.name()).finished();
  EXPECT_EQ(finished.state(), v1::SUCCEEDED) << finished.error().message();
}

TEST_F(HostileTest, RefusesMeshesThatAreBombs) {
  constexpr std::uint32_t kMany = 50'000'000;
  expect_failed(bake_mesh(attacks::draco_bomb(kMany), 2), grpc::INVALID_ARGUMENT,
                "mesh 'wall' has 50000000 triangles, its record says 2");
  const auto most = static_cast<std::uint32_t>(Limits{}.max_triangles);
  expect_failed(bake_mesh(attacks::draco_bomb(most), most), grpc::INVALID_ARGUMENT, "mesh 'wall' does not decode");
  expect_failed(bake_mesh("DRACO", 2), grpc::INVALID_ARGUMENT, "mesh 'wall'");
}

TEST_F(HostileTest, RefusesCountsBeforeAWorkerSeesThem) {
  using M = v1::SceneManifest;
  const auto expect_above = [&](const std::string& limit, const std::function<void(M&)>& change) {
    expect_refused(submit_changed(change), grpc::RESOURCE_EXHAUSTED, limit);
  };
  expect_above("max_vertices", [](M& m) { m.mutable_meshes(0)->set_num_vertices(1'000'000'000); });
  expect_above("max_triangles", [](M& m) { m.mutable_meshes(0)->set_num_triangles(1'000'000'000); });
  expect_above("max_texture_pixels", [](M& m) {
    m.mutable_textures(0)->set_width(1'000'000'000);
    m.mutable_textures(0)->set_height(1'000'000'000);
  });
  expect_above("max_meshes", [](M& m) {
    for (std::uint64_t i = 0; i < Limits{}.max_meshes; ++i) m.add_meshes();
  });
  expect_above("max_lights", [](M& m) {
    for (std::uint64_t i = 0; i <= Limits{}.max_lights; ++i) m.add_lights();
  });
}

TEST_F(HostileTest, TakesAManifestOfAsManyMeshesAsItMayHave) {
  // 8192 records of one blob: no limit is passed, and the blob is opened once.
  EXPECT_TRUE(submit_changed([](v1::SceneManifest& m) {
                while (m.meshes_size() < static_cast<int>(Limits{}.max_meshes)) {
                  v1::MeshRecord mesh = m.meshes(0);
                  mesh.set_num_vertices(3);
                  mesh.set_num_triangles(1);
                  mesh.set_name("");
                  *m.add_meshes() = mesh;
                }
              }).ok());
}

TEST_F(HostileTest, RefusesManifestsOfAMebibyteThatBecomeObjects) {
  const auto most = static_cast<int>(Limits{}.max_manifest_bytes);
  constexpr int kMeshes = 2, kMaterials = 3;
  expect_refused(submit_manifest(attacks::empty_fields(kMeshes, most / 2)), grpc::RESOURCE_EXHAUSTED,
                 std::to_string(most / 2));
  expect_refused(submit_manifest(attacks::empty_fields(kMaterials, most / 2)), grpc::RESOURCE_EXHAUSTED, "max_meshes");
  // What no record knows is kept as well, field by field.
  constexpr int kUnknown = 15;
  v1::Bake bake;
  EXPECT_TRUE(submit_manifest(attacks::empty_fields(kUnknown, most / 2), &bake).ok());
  expect_failed(client_.watch(bake.name()).finished(), grpc::INVALID_ARGUMENT, "the scene has no mesh");
  expect_refused(submit_manifest(attacks::empty_fields(kUnknown, most / 2) + "x"), grpc::RESOURCE_EXHAUSTED,
                 "max_manifest_bytes");
}

TEST_F(HostileTest, RefusesMessagesNestedInMessages) {
  const google::protobuf::LogSilencer silencer;
  const std::string nested = attacks::nested_groups(200'000);
  expect_refused(submit_manifest(nested), grpc::INVALID_ARGUMENT, "is not a SceneManifest");
  EXPECT_FALSE(call_raw(client_, "/radbake.v1.Bakes/SubmitBake", nested).ok());
  EXPECT_FALSE(call_raw(client_, "/radbake.v1.Content/FindMissing", attacks::claimed_field(1, 1U << 31)).ok());
}

TEST_F(HostileTest, RefusesAMessageThatIsOneByteTooLong) {
  const std::uint64_t most = Limits{}.max_message_bytes;
  expect_refused(call_raw(client_, "/radbake.v1.Bakes/SubmitBake", std::string(most + 1, '\0')),
                 grpc::RESOURCE_EXHAUSTED, std::to_string(most));
}

TEST_F(HostileTest, TakesNoMemoryForWhatIsCompressed) {
  // 512 MiB of zeros are half a mebibyte of gzip: within the limit on the wire.
  const std::string zeros(std::size_t{512} << 20, '\0');
  EXPECT_FALSE(call_raw(client_, "/radbake.v1.Bakes/SubmitBake", zeros, GRPC_COMPRESS_GZIP).ok());
}

TEST_F(HostileTest, RefusesDigestsThatLie) {
  const auto upload_as = [&](const v1::Digest& digest, const std::string& bytes, std::uint64_t offset = 0) {
    const auto context = new_context();
    const auto stream = client_.content->Upload(context.get());
    v1::UploadChunk chunk;
    *chunk.mutable_digest() = digest;
    chunk.set_offset(offset);
    chunk.set_data(bytes);
    chunk.set_finish(true);
    stream->Write(chunk);
    return finish_upload(*stream);
  };
  v1::Digest digest = digest_message("these bytes");
  expect_refused(upload_as(digest, "other bytes"), grpc::DATA_LOSS, "digest");
  expect_refused(upload_as(digest, "these bytes and more"), grpc::DATA_LOSS, "beyond its 11 bytes");
  EXPECT_EQ(upload_as(digest, "bytes", 1'000'000'000).error_code(), grpc::OUT_OF_RANGE);
  digest.set_size_bytes(std::uint64_t{1} << 60);
  expect_refused(upload_as(digest, "these bytes"), grpc::RESOURCE_EXHAUSTED, "max_blob_bytes");
  digest.set_sha256("../../../../../../../../../../../../../../../../../../tmp/escaped");
  expect_refused(upload_as(digest, "these bytes"), grpc::INVALID_ARGUMENT, "is not a SHA-256 digest");

  v1::FindMissingRequest request;
  for (std::uint64_t i = 0; i <= Limits{}.max_digests_per_call; ++i) *request.add_digests() = digest_message("x");
  v1::FindMissingResponse response;
  expect_refused(client_.content->FindMissing(new_context().get(), request, &response), grpc::RESOURCE_EXHAUSTED,
                 "max_digests_per_call");
}

TEST_F(HostileTest, TellsErrorsOfScenesWithLongNamesInFewWords) {
  const v1::Bake bake = bake_mesh("no mesh", 2, std::string(900'000, 'n'));
  expect_failed(bake, grpc::INVALID_ARGUMENT, "mesh 'nnn");
  EXPECT_LT(bake.error().message().size(), 5000U);
}

/// Fake workers that enter the sandbox of real ones and try what they may not.
class BreakOutTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!worker::filters_system_calls()) GTEST_SKIP() << "a sanitizer needs its system calls";
  }
  v1::Bake bake(FakeWork work) { return client_.watch(client_.submit(work).name()).finished(); }

  TemporaryFolder folder_;
  TestServer server_{TestServer::options_in(folder_.path())};
  TestClient client_ = server_.client();
};

TEST_F(BreakOutTest, EndsTheWorkerWithTheReasonAndNotTheServer) {
  for (const FakeWork work : {kStartProcess, kRunProgram, kOpenSocket, kWriteFile}) {
    const v1::Bake ended = bake(work);
    EXPECT_EQ(ended.state(), v1::FAILED) << work;
    EXPECT_EQ(ended.error().code(), grpc::INTERNAL) << work;
    EXPECT_THAT(ended.error().message(),
                HasSubstr("the worker was killed by SIGSYS (a system call that its sandbox forbids)"))
        << work;
  }
  EXPECT_EQ(bake(kSucceed).state(), v1::SUCCEEDED);
}

TEST_F(BreakOutTest, FindsNoFiles) { EXPECT_EQ(bake(kReadFile).error().message(), "No such file or directory"); }

TEST_F(BreakOutTest, EndsAWorkerThatNeedsMoreMemoryThanItsLimit) {
  TemporaryFolder folder;
  service::BakeServerOptions options = TestServer::options_in(folder.path());
  options.queue.worker.program = RADBAKE_WORKER;
  options.queue.worker.limits.address_space_bytes = std::uint64_t{1200} << 20;
  TestServer server(options);
  TestClient client = server.client();
  const EncodedScene scene = *encode_scene(good_scene(), {});
  for (const EncodedBlob& blob : scene.blobs) ASSERT_TRUE(client.upload(blob.bytes).ok());
  const auto bake_with_atlas = [&](std::uint32_t atlas_size) {
    v1::SubmitBakeRequest request =
        client.request_for(digest_message(scene.blobs.back().bytes), kSucceed, /*num_tiles=*/0);
    request.mutable_settings()->set_atlas_size(atlas_size);
    request.mutable_settings()->set_rays(8);
    v1::Bake bake;
    EXPECT_TRUE(client.bakes->SubmitBake(new_context().get(), request, &bake).ok());
    return client.watch(bake.name()).finished();
  };
  const v1::Bake ended = bake_with_atlas(4096);
  EXPECT_EQ(ended.state(), v1::FAILED);
  EXPECT_EQ(ended.error().code(), grpc::RESOURCE_EXHAUSTED) << ended.error().message();
  EXPECT_THAT(ended.error().message(), HasSubstr("the bake needs more memory than its limit of 1200 MiB"));
  const v1::Bake small = bake_with_atlas(64);
  EXPECT_EQ(small.state(), v1::SUCCEEDED) << small.error().message();
}

}  // namespace
}  // namespace radbake::testing

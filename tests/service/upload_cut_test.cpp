// A large upload over a connection that breaks: it goes on where it ended, and what arrives is what was sent.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "client/api/client.h"
#include "tests/record_figure.h"
#include "tests/service/cutting_proxy.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

constexpr std::size_t kCuts = 20;
/// RADBAKE_UPLOAD_BYTES asks for more.
constexpr std::uint64_t kDefaultBytes = std::uint64_t{96} << 20;

std::string random_bytes(std::uint64_t size) {
  std::mt19937_64 random(7);
  std::string bytes(size, '\0');
  for (std::uint64_t at = 0; at + 8 <= size; at += 8) {
    const std::uint64_t word = random();
    std::copy_n(reinterpret_cast<const char*>(&word), 8, bytes.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return bytes;
}

/// Where to cut: all over the upload, at random.
std::vector<std::uint64_t> random_cuts(std::uint64_t size) {
  std::mt19937_64 random(11);
  std::vector<std::uint64_t> places(kCuts);
  for (std::uint64_t& place : places) place = random() % size;
  std::sort(places.begin(), places.end());
  for (std::size_t i = kCuts; i-- > 1;) places[i] -= places[i - 1];
  return places;
}

TEST(UploadCut, GoesOnWhereItEndedAndSendsNoByteTwiceBeyondAChunk) {
  const char* asked = std::getenv("RADBAKE_UPLOAD_BYTES");
  const std::uint64_t size = asked != nullptr ? std::strtoull(asked, nullptr, 10) : kDefaultBytes;
  const std::string bytes = random_bytes(size);
  const Digest digest = digest_of(bytes);

  TemporaryFolder folder;
  service::BakeServerOptions options = TestServer::options_in(folder.path());
  options.limits.max_blob_bytes = size;
  TestServer server(options);
  CuttingProxy proxy(folder.path(), options.listen.substr(std::string("unix:").size()), random_cuts(size));
  auto client = api::Client::connect(proxy.address());
  ASSERT_TRUE(client.ok()) << client.error().message;

  // Where the offset falls back, what lies between has been sent twice.
  const std::uint64_t chunk = client->capabilities().limits().chunk_bytes();
  std::uint64_t last = 0, twice = 0, most_at_once = 0;
  const api::BlobView blob{digest, bytes};
  const auto sent = client->upload_missing({&blob, 1}, [&](std::uint64_t done, std::uint64_t) {
    if (done < last + std::min(chunk, size - last)) {
      const std::uint64_t again = last + chunk - done;
      twice += again;
      most_at_once = std::max(most_at_once, again);
    }
    last = done;
  });
  ASSERT_TRUE(sent.ok()) << sent.error().message;
  EXPECT_EQ(proxy.num_cuts(), kCuts);
  tests::record_figure("bytes_sent_twice", static_cast<double>(twice));
  tests::record_figure("most_at_once", static_cast<double>(most_at_once));
  EXPECT_LE(most_at_once, chunk);
  // Verified by the server before it has its name; and by us.
  EXPECT_EQ(*client->download(digest), bytes);
}

TEST(UploadCut, ConnectsOverASlowWay) {
  TemporaryFolder folder;
  const service::BakeServerOptions options = TestServer::options_in(folder.path());
  TestServer server(options);
  // As handshakes take over far networks and on busy machines.
  constexpr std::chrono::milliseconds kDelay{1500};
  const CuttingProxy proxy(folder.path(), options.listen.substr(std::string("unix:").size()), {}, kDelay);
  api::ClientOptions impatient;
  impatient.call_patience = std::chrono::milliseconds(500);
  const auto client = api::Client::connect(proxy.address(), impatient);
  EXPECT_TRUE(client.ok()) << client.error().message;
}

}  // namespace
}  // namespace radbake::testing

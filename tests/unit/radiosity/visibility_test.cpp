#include "server/radiosity/visibility/visibility.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <random>

namespace radbake::radiosity {
namespace {

std::vector<Corners> random_triangles(int n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-1, 1), size(-0.3, 0.3);
  std::vector<Corners> triangles;
  for (int i = 0; i < n; ++i) {
    const Vec3 a{place(random), place(random), place(random)};
    triangles.push_back(
        {a, a + Vec3{size(random), size(random), size(random)}, a + Vec3{size(random), size(random), size(random)}});
  }
  return triangles;
}

std::vector<Ray> random_rays(int n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> any(-1, 1);
  std::vector<Ray> rays;
  for (int i = 0; i < n; ++i) {
    rays.push_back({{any(random), any(random), any(random)}, {any(random), any(random), any(random)}});
  }
  return rays;
}

std::ptrdiff_t num_threads() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/task"), std::filesystem::directory_iterator());
}

// A tree that several threads build may order its leaves by chance, and the order decides ties. As ctest starts each
// test in a process of its own, no thread is there that a parallel build could use.
TEST(Visibility, OfEmbreeIsBuiltOnOneThread) {
  const auto triangles = random_triangles(100000, 8);
  const std::ptrdiff_t before = num_threads();
  const auto embree = make_embree_visibility(triangles);
  EXPECT_EQ(num_threads(), before);
}

TEST(Visibility, OfEmbreeThrowsWhereMemoryEnds) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose shadow takes terabytes of addresses
  const auto triangles = random_triangles(200000, 9);
  constexpr rlim_t kMebibyte = 1 << 20;
  // From what the first vertices do not fit into, to what the tree does.
  bool is_built = false;
  for (rlim_t mebibytes = 1; mebibytes <= 1024; mebibytes *= 2) {
    const pid_t child = fork();
    if (child == 0) {
      rlim_t pages = 0;
      std::ifstream("/proc/self/statm") >> pages;
      const rlim_t most = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + mebibytes * kMebibyte;
      const rlimit limit{most, most};
      setrlimit(RLIMIT_AS, &limit);
      try {
        make_embree_visibility(triangles);
        _exit(0);
      } catch (const std::bad_alloc&) {
        _exit(1);
      }
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status)) << mebibytes << " MiB: signal " << WTERMSIG(status);
    if (mebibytes == 1) {
      EXPECT_EQ(WEXITSTATUS(status), 1);
    }
    is_built = WEXITSTATUS(status) == 0;
  }
  EXPECT_TRUE(is_built);
#endif
}

// Single and double precision may disagree on rays that graze an edge: about 1 in 1e5 here.
TEST(Visibility, OfEmbreeAgreesWithBruteForce) {
  constexpr int kRays = 20000;
  constexpr int kGrazing = 4;
  const auto triangles = random_triangles(300, 1);
  const auto embree = make_embree_visibility(triangles);
  const auto slow = make_brute_force_visibility(triangles);
  std::vector<Ray> rays = random_rays(kRays, 2);
  std::vector<Hit> fast_hits(kRays), slow_hits(kRays);
  embree->trace(rays, fast_hits);
  slow->trace(rays, slow_hits);
  int different = 0, hits = 0;
  for (int i = 0; i < kRays; ++i) {
    different += fast_hits[i].triangle != slow_hits[i].triangle;
    hits += slow_hits[i].triangle != kNoHit;
    if (fast_hits[i].triangle == slow_hits[i].triangle && slow_hits[i].triangle != kNoHit) {
      EXPECT_NEAR(fast_hits[i].u, slow_hits[i].u, 1e-3);
      EXPECT_NEAR(fast_hits[i].v, slow_hits[i].v, 1e-3);
    }
  }
  EXPECT_GT(hits, kRays / 10);
  EXPECT_LE(different, kGrazing);

  for (Ray& ray : rays) ray.max_distance = 0.5f;
  std::vector<std::uint8_t> fast_blocked(kRays), slow_blocked(kRays);
  embree->blocked(rays, fast_blocked);
  slow->blocked(rays, slow_blocked);
  different = 0;
  for (int i = 0; i < kRays; ++i) different += fast_blocked[i] != slow_blocked[i];
  EXPECT_LE(different, kGrazing);
}

TEST(Visibility, FindsEveryTriangleNearAPoint) {
  const auto triangles = random_triangles(500, 3);
  const auto embree = make_embree_visibility(triangles);
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<std::uint32_t> found;
  for (int k = 0; k < 200; ++k) {
    const Vec3 point{any(random), any(random), any(random)};
    const double distance = 0.2;
    embree->triangles_near(point, distance, found);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      // A corner within the distance is enough to be near.
      const bool has_near_corner =
          std::any_of(triangles[t].begin(), triangles[t].end(), [&](Vec3 c) { return length(c - point) <= distance; });
      EXPECT_TRUE(!has_near_corner || std::binary_search(found.begin(), found.end(), t));
    }
  }
}

TEST(Visibility, FindsEveryTriangleThatReachesIntoAShaft) {
  constexpr int kTriangles = 500, kPointsOfTriangle = 60;
  const auto triangles = random_triangles(kTriangles, 5);
  const auto embree = make_embree_visibility(triangles);
  const auto slow = make_brute_force_visibility(triangles);
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> any(-1, 1), share(0, 1);
  std::vector<std::uint32_t> found, found_slowly;
  std::size_t num_inside = 0, num_found = 0;
  for (int k = 0; k < 100; ++k) {
    Shaft shaft{{any(random), any(random), any(random)}, {any(random), any(random), any(random)}, 0.02, {}};
    if (k % 4 == 1) shaft.end = shaft.begin + (shaft.end - shaft.begin) * 0.01;
    if (k % 4 == 2) shaft.radius = 0.3;
    const Vec3 axis = shaft.end - shaft.begin, along = normalized(axis), across = Frame(along).s;
    shaft.half_spaces = {{along, dot(along, shaft.begin)}, {across, dot(across, shaft.begin) - shaft.radius / 4}};
    embree->triangles_in(shaft, found);
    slow->triangles_in(shaft, found_slowly);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
    num_found += found.size();
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      bool is_inside = false;
      for (int i = 0; i < kPointsOfTriangle; ++i) {
        const double u = share(random), v = share(random) * (1 - u);
        const Vec3 p = triangles[t][0] * (1 - u - v) + triangles[t][1] * u + triangles[t][2] * v;
        const double s = std::clamp(dot(p - shaft.begin, axis) / dot(axis, axis), 0.0, 1.0);
        is_inside = is_inside || (length(p - shaft.begin - axis * s) <= shaft.radius &&
                                  std::all_of(shaft.half_spaces.begin(), shaft.half_spaces.end(),
                                              [&](const auto& half) { return dot(half.normal, p) >= half.offset; }));
      }
      num_inside += is_inside;
      EXPECT_TRUE(!is_inside || std::binary_search(found.begin(), found.end(), t)) << k << " " << t;
      EXPECT_TRUE(!is_inside || std::binary_search(found_slowly.begin(), found_slowly.end(), t)) << k << " " << t;
    }
  }
  EXPECT_GT(num_inside, 100u);
  // It tells near from far: a superset, but a small part of all.
  EXPECT_LT(num_found, 100u * kTriangles / 4);
}

TEST(Visibility, LetsNoRayEscapeBetweenTrianglesOfAClosedBox) {
  // A cube of 12 triangles, rays from its middle at its edges and corners among others.
  std::vector<Corners> box;
  const Vec3 corner[8] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                          {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  const int quads[6][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7, 6}, {1, 2, 6, 5}, {0, 3, 7, 4}};
  for (const auto& q : quads) {
    box.push_back({corner[q[0]], corner[q[1]], corner[q[2]]});
    box.push_back({corner[q[0]], corner[q[2]], corner[q[3]]});
  }
  const auto embree = make_embree_visibility(box);
  std::vector<Ray> rays;
  for (int i = -50; i <= 50; ++i) {
    for (int j = -50; j <= 50; ++j) {
      // Directions on and around the box's edges and diagonals.
      rays.push_back({{0.1f, -0.2f, 0.3f}, {1.0f, static_cast<float>(i) / 50, static_cast<float>(j) / 50}});
      rays.push_back({{0, 0, 0}, {static_cast<float>(i) / 50, 1.0f, static_cast<float>(j) / 50}});
      rays.push_back({{0, 0, 0}, {1.0f, 1.0f, static_cast<float>(j) / 50}});
    }
  }
  std::vector<Hit> hits(rays.size());
  embree->trace(rays, hits);
  for (const Hit& hit : hits) EXPECT_NE(hit.triangle, kNoHit);
}

TEST(EmbreeVisibility, IsNotBuiltWhenItIsCancelled) {
  const std::vector<Corners> triangles = random_triangles(100'000, 3);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(make_embree_visibility(triangles, stop.get_token()), nullptr);
  // What was cancelled leaves nothing behind for the next one.
  EXPECT_NE(make_embree_visibility(triangles), nullptr);
}

}  // namespace
}  // namespace radbake::radiosity

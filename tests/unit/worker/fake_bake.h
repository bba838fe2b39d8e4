#pragma once

#include <atomic>
#include <cstdint>

namespace radbake {

/// What the fake of the numeric library does, chosen by the seed of the settings.
enum FakeBake : std::uint64_t {
  kBakes = 0,         ///< goes through all stages and sends two tiles
  kWaitsForStop = 1,  ///< bakes until it is stopped
  kFails = 2,         ///< the solver does not converge
  kTakesAllMemory = 3,
  kIsSilent = 4,        ///< says nothing until three heartbeats may have passed
  kFloods = 5,          ///< sends kNumFloodTiles tiles as fast as it can
  kWaitsForFinish = 6,  ///< waits until it is to finish, then bakes; or until it is stopped
};

inline constexpr int kNumFloodTiles = 400;
inline constexpr int kFakeAtlasSize = 128;

/// Tiles that the fake has passed to its observer, and whether it saw a stop. Reset by each fake bake.
extern std::atomic<int> num_fake_tiles;
extern std::atomic<bool> fake_saw_stop;
/// The time that the last fake bake was told to take.
extern std::atomic<double> fake_time_budget_seconds;

}  // namespace radbake

#pragma once

namespace radbake::testing {

/// What the fake worker does: a test puts the number into BakeSettings.seed.
enum FakeWork {
  kSucceed = 1,             ///< all states, BakeSettings.transport_memory_bytes tiles, one layer
  kFailBadScene = 2,        ///< reports INVALID_ARGUMENT
  kCrash = 3,               ///< ends by SIGSEGV in the middle
  kExitWithMessage = 4,     ///< writes a line to stderr and exits with code 7
  kHang = 5,                ///< says nothing any more
  kRunUntilCancelled = 6,   ///< reports progress until it is told to stop, or to finish: then as kSucceed
  kIgnoreCancel = 7,        ///< reports progress for ever
  kSendWrongDigest = 8,     ///< its layer does not have the digest that it claims
  kNameUnsentBlob = 9,      ///< its result names a blob that it never sent
  kListDescriptors = 10,    ///< fails with the list of its open descriptors
  kSucceedSecondTime = 11,  ///< attempt 1 as kRunUntilCancelled, attempt 2 as kSucceed
  kReadInputs = 12,         ///< fails with the sum of the sizes of its inputs, read from their descriptors
  kDieAfterTiles = 13,  ///< attempt 1 ends by SIGSEGV when it is told to finish, half its tiles sent; then as kSucceed
  kNearlyDone = 40,     ///< as kRunUntilCancelled, but says all the time that it is nearly done
  // In the sandbox of real workers:
  kStartProcess = 30,  ///< forks
  kRunProgram = 31,    ///< executes /bin/true in its place
  kOpenSocket = 32,    ///< a network socket
  kWriteFile = 33,     ///< opens a file in the temporary folder for writing
  kReadFile = 34,      ///< fails with what open() of /etc/passwd says
};

// What a worker does before it has its work goes by its program's name.
inline constexpr char kWrongAttemptName[] = "worker-of-a-wrong-attempt";
inline constexpr char kWrongVersionName[] = "worker-of-a-wrong-version";
inline constexpr char kMuteName[] = "worker-that-never-connects";
inline constexpr char kDeadWhileReadyName[] = "worker-that-does-not-wait";
/// What a worker that was started ahead of need says on stderr when it gets its work.
inline constexpr char kReadyWords[] = "the fake worker was ready";

/// Side of the tiles, and width of the layer, which is as high as its tiles.
inline constexpr int kTileSize = 8;
inline constexpr int kFakeChannels = 4;
/// Patches in every fake plan.
inline constexpr int kFakePatches = 42;
/// What every fake bake says that a ray of a row costs, seconds.
inline constexpr double kFakeRayCost = 0.0625;
/// What every fake bake says that it traced, and how fast.
inline constexpr unsigned kFakeRays = 1000, kFakeRaysPerSecond = 250;
/// What kNearlyDone says that it still needs, seconds.
inline constexpr double kFakeSecondsLeft = 0.25;
/// What every fake bake says of its error when it tells its progress.
inline constexpr unsigned kFakePass = 2;
inline constexpr double kFakeError = 0.25, kFakeErrorLow = 0.125, kFakeErrorHigh = 0.5;
inline constexpr char kLastWords[] = "the fake worker says good-bye";

}  // namespace radbake::testing

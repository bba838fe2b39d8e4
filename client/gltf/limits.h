#pragma once

#include <cstddef>
#include <cstdint>

namespace radbake::gltf {

// What a file may ask for before any memory is taken for it. Far above what a bake can use, and low enough that no
// file, however made, takes a workstation down.
inline constexpr std::uint64_t kMaxFileBytes = std::uint64_t{1} << 30;  ///< of the file, and of all buffers together
inline constexpr std::size_t kMaxJsonValues = 10'000'000;               ///< each takes some 100 bytes once parsed
inline constexpr int kMaxJsonDepth = 64;                                ///< parsers and destructors recurse
inline constexpr std::uint64_t kMaxCount = 150'000'000;                 ///< elements of an accessor
inline constexpr std::uint64_t kMaxUnbackedElements = 1'000'000;        ///< of an accessor without a buffer view
inline constexpr std::uint64_t kMaxSceneTriangles = 50'000'000;         ///< with all instances placed
inline constexpr std::uint64_t kMaxSceneVertices = 50'000'000;          ///< with all instances placed
inline constexpr std::uint64_t kMaxSceneIesBytes = std::uint64_t{64} << 20;  ///< of all luminaires' files together

}  // namespace radbake::gltf

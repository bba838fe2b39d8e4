#pragma once

namespace radbake {

/// Version of the engine, from CMake's project(): part of the bake key, since another engine may bake other bytes.
extern const char* const kEngineVersion;

/// Version of the wire protocol. Peers of another major version must not talk; a higher minor only adds fields.
///   1  an upload is answered chunk by chunk where it asks for that: UploadChunk.wants_progress
inline constexpr unsigned kProtocolMajor = 1;
inline constexpr unsigned kProtocolMinor = 1;
/// The first minor version whose servers answer chunks.
inline constexpr unsigned kAnswersChunksMinor = 1;

}  // namespace radbake

#pragma once

namespace radbake {

/// Version of the engine, from CMake's project(): part of the bake key, since another engine may bake other bytes.
extern const char* const kEngineVersion;

/// Version of the wire protocol. Peers of another major version must not talk; a higher minor only adds fields.
inline constexpr unsigned kProtocolMajor = 1;
inline constexpr unsigned kProtocolMinor = 0;

}  // namespace radbake

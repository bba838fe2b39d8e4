#pragma once

#include <cstddef>
#include <cstdint>

/// One input of a fuzzer. Every *_target.cpp defines it; libFuzzer calls it, and so does replay.cpp, which runs the
/// committed inputs as an ordinary test. Ends the process where the input finds a fault.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);

#pragma once

#include <draco/mesh/mesh.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/base/result.h"

namespace radbake {

/// An attribute that a blob must have.
struct ExpectedAttribute {
  std::uint32_t unique_id = 0;
  draco::GeometryAttribute::Type type = draco::GeometryAttribute::INVALID;
  draco::DataType data_type = draco::DT_INVALID;
  int num_components = 0;
  const char* name = "";
};

/// Decodes a Draco mesh whose head was checked. Its attributes must be just the expected ones: Draco takes memory for
/// all that a blob declares, up to 255 doubles a point, so they are held against the list before any is decoded. None
/// may be predicted by another one (Draco's speeds below 4).
///
/// Errors: kInvalidArgument; kResourceExhausted where memory does not suffice.
Result<std::unique_ptr<draco::Mesh>> decode_draco(const std::string& blob,
                                                  std::span<const ExpectedAttribute> attributes);

}  // namespace radbake

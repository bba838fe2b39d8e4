#pragma once

#include <string>

#include "common/base/result.h"

namespace radbake::access {

/// What a caller may do. Both submit bakes; an admin also sees and stops those of other tenants.
enum class Role { kSubmit, kAdmin };

/// Who makes a call, once that is proven.
struct Caller {
  std::string tenant;  ///< whose bakes and blobs these are; empty where nobody has to say who he is
  Role role = Role::kSubmit;

  bool operator==(const Caller&) const = default;
};

/// "submit" or "admin". Errors: kInvalidArgument.
Result<Role> parse_role(const std::string& text);

/// Checks that a tenant's name has 1 to 128 letters, digits or any of . _ - + @ : / (so it is safe in logs and files of
/// settings). Errors: kInvalidArgument.
Result<void> validate_tenant(const std::string& tenant);

}  // namespace radbake::access

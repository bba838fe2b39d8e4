#include "server/access/caller.h"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace radbake::access {
namespace {

constexpr std::size_t kMaxTenantBytes = 128;
constexpr std::size_t kMaxQuotedBytes = 40;
constexpr std::string_view kTenantMarks = "._-+@:/";

bool is_tenant_letter(unsigned char c) {
  return c < 128 && (std::isalnum(c) != 0 || kTenantMarks.find(static_cast<char>(c)) != std::string_view::npos);
}

}  // namespace

Result<Role> parse_role(const std::string& text) {
  if (text == "submit") return Role::kSubmit;
  if (text == "admin") return Role::kAdmin;
  return invalid_argument("role '" + text.substr(0, kMaxQuotedBytes) + "' is neither submit nor admin");
}

Result<void> validate_tenant(const std::string& tenant) {
  if (!tenant.empty() && tenant.size() <= kMaxTenantBytes &&
      std::all_of(tenant.begin(), tenant.end(), is_tenant_letter))
    return {};
  std::string shown = tenant.substr(0, kMaxQuotedBytes);
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return c < 32 || c > 126; }, '?');
  return invalid_argument("tenant '" + shown + "' (" + std::to_string(tenant.size()) + " bytes) must have 1 to " +
                          std::to_string(kMaxTenantBytes) + " letters, digits or any of " + std::string(kTenantMarks));
}

}  // namespace radbake::access

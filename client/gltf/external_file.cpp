#include "client/gltf/external_file.h"

#include <algorithm>
#include <charconv>
#include <system_error>

#include "client/gltf/entry.h"

namespace radbake::gltf {
namespace {

// %41 -> A. What is not a valid escape stays.
std::string percent_decoded(const std::string& text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned char byte = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(&text[i + 1], &text[i + 3], byte, 16).ptr == &text[i + 3]) {
      decoded.push_back(static_cast<char>(byte));
      i += 2;
    } else {
      decoded.push_back(text[i]);
    }
  }
  return decoded;
}

}  // namespace

Result<std::filesystem::path> resolve_uri(const std::filesystem::path& folder, const std::string& uri) {
  if (uri.find("://") != std::string::npos) return invalid_argument(in_quotes(uri) + " is not a file beside the scene");
  return resolve_path(folder, percent_decoded(uri));
}

Result<std::filesystem::path> resolve_path(const std::filesystem::path& folder, const std::filesystem::path& relative) {
  const bool climbs = std::find(relative.begin(), relative.end(), "..") != relative.end();
  if (relative.empty() || relative.is_absolute() || climbs || relative.native().find('\0') != std::string::npos) {
    return invalid_argument(in_quotes(relative.native()) + " is not a path inside the scene's folder");
  }
  std::error_code error;
  const std::filesystem::path inside = std::filesystem::canonical(folder.empty() ? "." : folder, error);
  const std::filesystem::path file = std::filesystem::canonical(inside / relative, error);
  if (error || !std::filesystem::is_regular_file(file, error)) {
    return invalid_argument("file " + in_quotes(relative.native()) + " is missing");
  }
  if (std::mismatch(inside.begin(), inside.end(), file.begin(), file.end()).first != inside.end()) {
    return invalid_argument(in_quotes(relative.native()) + " links to a file outside the scene's folder");
  }
  return file;
}

}  // namespace radbake::gltf

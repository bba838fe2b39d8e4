#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>

#include "client/gltf/check_document.h"
#include "client/gltf/external_file.h"
#include "client/gltf/limits.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;

constexpr std::string_view kBase64 = ";base64,";

// Bytes that a data URI holds. Our spelling of its media type goes into the document: tinygltf knows few of them.
Result<std::uint64_t> normalise_data_uri(std::string& uri, const Entry& buffer) {
  const std::size_t marker = uri.substr(0, 200).find(kBase64);
  if (marker == std::string::npos) return buffer.error("its data URI is not in base64");
  std::size_t end = uri.size();
  while (end > 0 && uri[end - 1] == '=') --end;
  const std::size_t begin = marker + kBase64.size();
  if (end < begin) end = begin;
  const auto is_base64 = [](unsigned char c) { return std::isalnum(c) || c == '+' || c == '/'; };
  const auto wrong = std::find_if_not(uri.begin() + begin, uri.begin() + end, is_base64);
  if (wrong != uri.begin() + end) {
    return buffer.error("its data URI has a character that is not base64 at offset " +
                        std::to_string(wrong - uri.begin()));
  }
  uri = "data:application/octet-stream;base64," + uri.substr(begin);
  return (end - begin) * 6 / 8;
}

// Size of what a buffer names.
Result<std::uint64_t> available_bytes(json& object, const Entry& buffer, std::size_t index,
                                      const std::filesystem::path& folder, std::uint64_t bin_bytes) {
  RADBAKE_RETURN_IF_ERROR(buffer.text("uri"));
  if (buffer.find("uri") == nullptr) {
    if (index == 0 && bin_bytes > 0) return bin_bytes;
    return buffer.error("it has no uri and the file has no binary chunk for it: the buffer is missing");
  }
  auto& uri = object["uri"].get_ref<std::string&>();
  if (uri.starts_with("data:")) return normalise_data_uri(uri, buffer);
  const Result<std::filesystem::path> file = resolve_uri(folder, uri);
  if (!file.ok()) return buffer.error(file.error().message);
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(*file, error);
  if (error) return buffer.error("the size of " + in_quotes(uri) + " cannot be read");
  return size;
}

}  // namespace

Result<void> check_buffers(json& document, const std::filesystem::path& folder, std::uint64_t bin_bytes) {
  const Entry root(document, "");
  // Sizes first: views are held against what a buffer declares.
  std::vector<std::uint64_t> declared, available;
  std::uint64_t total = 0;
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> buffers, root.list("buffers", "buffer"));
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t bytes, buffers[i].required_whole_number("byteLength"));
    if (bytes == 0) return buffers[i].error("byteLength is 0");
    RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t size,
                             available_bytes(document["buffers"][i], buffers[i], i, folder, bin_bytes));
    if (bytes > size) {
      return buffers[i].error("byteLength is " + std::to_string(bytes) + ", but only " + std::to_string(size) +
                              " bytes are there");
    }
    total += size;
    if (total > kMaxFileBytes) {
      return buffers[i].error("the buffers have " + std::to_string(total) + " bytes, above the limit of " +
                              std::to_string(kMaxFileBytes));
    }
    declared.push_back(bytes);
    available.push_back(size);
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> views, root.list("bufferViews", "buffer view"));
  for (const Entry& view : views) {
    RADBAKE_RETURN_IF_ERROR(view.required_whole_number("buffer"));
    RADBAKE_ASSIGN_OR_RETURN(const auto buffer, view.index("buffer", buffers.size(), "buffers"));
    RADBAKE_ASSIGN_OR_RETURN(const auto offset, view.whole_number("byteOffset"));
    RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t length, view.required_whole_number("byteLength"));
    if (length == 0) return view.error("byteLength is 0");
    const std::uint64_t end = offset.value_or(0) + length;
    if (end > declared[*buffer]) {
      return view.error("it ends at byte " + std::to_string(end) + " of buffer " + std::to_string(*buffer) +
                        ", which has " + std::to_string(declared[*buffer]));
    }
    RADBAKE_ASSIGN_OR_RETURN(const auto stride, view.whole_number("byteStride"));
    if (stride && (*stride < 4 || *stride > 252 || *stride % 4 != 0)) {
      return view.error("byteStride is " + std::to_string(*stride) + ", not a multiple of 4 from 4 to 252");
    }
  }
  // tinygltf insists on equal sizes.
  for (std::size_t i = 0; i < available.size(); ++i) document["buffers"][i]["byteLength"] = available[i];
  return {};
}

}  // namespace radbake::gltf

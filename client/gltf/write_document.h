#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "client/gltf/write_elements.h"
#include "common/base/result.h"

namespace radbake::gltf {

/// A glTF file on its way to being written again: its own JSON, and all its buffers and images as one binary chunk.
///
/// Whatever is not asked to change stays as it is, known or not. What is added comes last, so no index changes.
/// Functions without a Result throw std::exception where the file is not what it was when it was checked.
class Document {
 public:
  OrderedJson json;

  /// Reads, checks and loads a file; images and light profiles of other files and data URIs move into the chunk.
  /// One that is missing, or an image of a kind that is not known, keeps its URI.
  /// Errors: kInvalidArgument, as read_gltf().
  static Result<Document> load(const std::filesystem::path& path);

  /// Values of an accessor, sparse ones in their places; zeros where it has no view.
  Elements elements(std::size_t accessor) const;
  /// Bytes of a view, valid until something is added.
  std::string_view view_bytes(std::size_t view) const;

  enum class Use { kVertices, kIndices };
  /// Adds values; returns the accessor's index.
  /// `like`: an accessor whose name and extras are kept, and its bounds where it had any; or null.
  /// `with_bounds`: min and max are written in any case, as POSITION needs them.
  std::size_t add_accessor(const Elements& elements, Use use, const OrderedJson& like, bool with_bounds);
  std::size_t add_image(const std::string& name, const std::string& bytes, const std::string& media_type);
  /// Appends to a list of the file; returns the index.
  std::size_t add(const char* list, OrderedJson object);

  void use_extension(const std::string& name);
  void drop_extension(const std::string& name);

  /// Writes a .glb. Errors: kInternal if it is above 4 GiB or cannot be written.
  Result<void> write(const std::filesystem::path& path);

 private:
  void load_profiles(const std::filesystem::path& folder);
  std::size_t add_view(const std::string& bytes, int target, std::size_t stride);

  std::string bin_;
};

}  // namespace radbake::gltf

#include "client/image/image_codec.h"

#include <dlfcn.h>

#include <string>
#include <system_error>

#include "common/base/version.h"

namespace radbake::image {
namespace {

namespace fs = std::filesystem;

constexpr char kLibraryName[] = "libradbake_image.so";

Result<fs::path> find_library() {
  std::error_code failure;
  const fs::path self = fs::read_symlink("/proc/self/exe", failure);
  if (failure) return internal_error("cannot find the running program: " + failure.message());
  const fs::path beside = self.parent_path();
  const fs::path lib = beside.parent_path() / "lib";
  for (const fs::path& folder : {beside, lib}) {
    if (fs::exists(folder / kLibraryName, failure)) return folder / kLibraryName;
  }
  return internal_error("no " + std::string(kLibraryName) + " in " + beside.string() + " or " + lib.string() +
                        ": without it, no image is read or written");
}

}  // namespace

Result<const ImageCodec*> load_image_codec(const fs::path& library) {
  // OpenImageIO and the hundred libraries that it brings: to look up all their functions now would cost 50 ms more.
  void* const loaded = dlopen(fs::absolute(library).c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (loaded == nullptr) return internal_error("cannot load " + library.string() + ": " + dlerror());
  const auto symbol = reinterpret_cast<ImageCodecSymbol*>(dlsym(loaded, kImageCodecSymbol));
  if (symbol == nullptr) return internal_error(library.string() + " is no image library of radbake");
  const ImageCodec* const codec = symbol();
  if (std::string(codec->engine_version) != kEngineVersion) {
    return internal_error(library.string() + " is of version " + codec->engine_version + " and this program of " +
                          kEngineVersion + ": install both anew");
  }
  return codec;
}

Result<const ImageCodec*> load_image_codec() {
  static const Result<const ImageCodec*> codec = []() -> Result<const ImageCodec*> {
    RADBAKE_ASSIGN_OR_RETURN(const fs::path library, find_library());
    return load_image_codec(library);
  }();
  return codec;
}

}  // namespace radbake::image

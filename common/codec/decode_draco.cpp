#include "common/codec/decode_draco.h"

#include <draco/compression/config/decoder_options.h>
#include <draco/compression/decode.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>

#include <exception>
#include <new>
#include <optional>
#include <utility>

namespace radbake {
namespace {

/// Holds the attributes that a blob has declared against those that it must have.
std::optional<Error> find_problem(const draco::PointCloud& declared, std::span<const ExpectedAttribute> expected) {
  if (declared.num_attributes() != static_cast<int>(expected.size())) {
    return invalid_argument("has " + std::to_string(declared.num_attributes()) + " attributes, its record says " +
                            std::to_string(expected.size()));
  }
  for (const ExpectedAttribute& wanted : expected) {
    const draco::PointAttribute* found = declared.GetAttributeByUniqueId(wanted.unique_id);
    if (found != nullptr && found->attribute_type() == wanted.type && found->data_type() == wanted.data_type &&
        found->num_components() == wanted.num_components) {
      continue;
    }
    return invalid_argument(std::string("has no attribute ") + wanted.name + " of the right type");
  }
  return std::nullopt;
}

/// A mesh whose decoder finds no positions to predict other attributes by.
///
/// That prediction reads a count of its own, which Draco 1.5.5 does not hold against anything: 500 bytes may keep it
/// busy for 10 s and take 256 MB. Our encoder does not use it.
class SelfPredictedMesh : public draco::Mesh {
 public:
  void SetAttribute(int id, std::unique_ptr<draco::PointAttribute> attribute) override {
    using Type = draco::GeometryAttribute;
    const Type::Type type = attribute->attribute_type();
    // Attributes are found by the type that they come with.
    if (type == Type::POSITION) attribute->set_attribute_type(Type::GENERIC);
    draco::Mesh::SetAttribute(id, std::move(attribute));
    this->attribute(id)->set_attribute_type(type);
  }
};

/// One of Draco's decoders that looks at the attributes when it knows what they are and has decoded none.
template <typename Decoder>
class CheckingDecoder : public Decoder {
 public:
  explicit CheckingDecoder(std::span<const ExpectedAttribute> expected) : expected_(expected) {}
  const std::optional<Error>& problem() const { return problem_; }

 protected:
  bool DecodeAllAttributes() override {
    problem_ = find_problem(*this->point_cloud(), expected_);
    return !problem_ && Decoder::DecodeAllAttributes();
  }

 private:
  const std::span<const ExpectedAttribute> expected_;
  std::optional<Error> problem_;
};

template <typename Decoder>
Result<std::unique_ptr<draco::Mesh>> decode_by(const std::string& blob, std::span<const ExpectedAttribute> expected) {
  draco::DecoderBuffer buffer;
  buffer.Init(blob.data(), blob.size());
  std::unique_ptr<draco::Mesh> mesh = std::make_unique<SelfPredictedMesh>();
  CheckingDecoder<Decoder> decoder(expected);
  const draco::Status status = decoder.Decode(draco::DecoderOptions(), &buffer, mesh.get());
  if (decoder.problem()) return *decoder.problem();
  if (!status.ok()) return invalid_argument("does not decode: " + status.error_msg_string());
  return mesh;
}

}  // namespace

Result<std::unique_ptr<draco::Mesh>> decode_draco(const std::string& blob,
                                                  std::span<const ExpectedAttribute> attributes) {
  try {
    constexpr std::size_t kMethodAt = 8;
    const bool is_sequential = blob.size() > kMethodAt && blob[kMethodAt] == draco::MESH_SEQUENTIAL_ENCODING;
    return is_sequential ? decode_by<draco::MeshSequentialDecoder>(blob, attributes)
                         : decode_by<draco::MeshEdgebreakerDecoder>(blob, attributes);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kResourceExhausted, "needs more memory to decode than there is"};
  } catch (const std::exception& exception) {
    return invalid_argument(std::string("does not decode: ") + exception.what());
  }
}

}  // namespace radbake

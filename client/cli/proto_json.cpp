#include "client/cli/proto_json.h"

#include <google/protobuf/descriptor.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace radbake::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using Json = nlohmann::ordered_json;
constexpr auto kReplace = Json::error_handler_t::replace;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// The name of an enum's value; a newer peer may send one that we have no name for.
Json enum_name(const google::protobuf::EnumDescriptor* type, int value) {
  const auto* known = type->FindValueByNumber(value);
  return known ? Json(known->name()) : Json(value);
}

Json single_value(const Message& message, const Reflection& read, const FieldDescriptor* field) {
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32: return read.GetInt32(message, field);
    case FieldDescriptor::CPPTYPE_INT64: return read.GetInt64(message, field);
    case FieldDescriptor::CPPTYPE_UINT32: return read.GetUInt32(message, field);
    case FieldDescriptor::CPPTYPE_UINT64: return read.GetUInt64(message, field);
    case FieldDescriptor::CPPTYPE_DOUBLE: return number(read.GetDouble(message, field));
    case FieldDescriptor::CPPTYPE_FLOAT: return number(read.GetFloat(message, field));
    case FieldDescriptor::CPPTYPE_BOOL: return read.GetBool(message, field);
    case FieldDescriptor::CPPTYPE_ENUM: return enum_name(field->enum_type(), read.GetEnumValue(message, field));
    case FieldDescriptor::CPPTYPE_STRING: return read.GetString(message, field);
    case FieldDescriptor::CPPTYPE_MESSAGE: return to_json(read.GetMessage(message, field));
  }
  return {};
}

Json repeated_value(const Message& message, const Reflection& read, const FieldDescriptor* field, int i) {
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32: return read.GetRepeatedInt32(message, field, i);
    case FieldDescriptor::CPPTYPE_INT64: return read.GetRepeatedInt64(message, field, i);
    case FieldDescriptor::CPPTYPE_UINT32: return read.GetRepeatedUInt32(message, field, i);
    case FieldDescriptor::CPPTYPE_UINT64: return read.GetRepeatedUInt64(message, field, i);
    case FieldDescriptor::CPPTYPE_DOUBLE: return number(read.GetRepeatedDouble(message, field, i));
    case FieldDescriptor::CPPTYPE_FLOAT: return number(read.GetRepeatedFloat(message, field, i));
    case FieldDescriptor::CPPTYPE_BOOL: return read.GetRepeatedBool(message, field, i);
    case FieldDescriptor::CPPTYPE_ENUM:
      return enum_name(field->enum_type(), read.GetRepeatedEnumValue(message, field, i));
    case FieldDescriptor::CPPTYPE_STRING: return read.GetRepeatedString(message, field, i);
    case FieldDescriptor::CPPTYPE_MESSAGE: return to_json(read.GetRepeatedMessage(message, field, i));
  }
  return {};
}

}  // namespace

Json to_json(const Message& message) {
  Json json = Json::object();
  const Reflection& read = *message.GetReflection();
  const auto* type = message.GetDescriptor();
  for (int f = 0; f < type->field_count(); ++f) {
    const FieldDescriptor* field = type->field(f);
    if (field->type() == FieldDescriptor::TYPE_BYTES) continue;
    if (field->is_repeated()) {
      Json list = Json::array();
      for (int i = 0; i < read.FieldSize(message, field); ++i) {
        list.push_back(repeated_value(message, read, field, i));
      }
      json[field->name()] = std::move(list);
    } else if (!field->has_presence() || read.HasField(message, field)) {
      json[field->name()] = single_value(message, read, field);
    }
  }
  return json;
}

std::string to_line(const Json& json) { return json.dump(-1, ' ', false, kReplace); }
std::string to_text(const Json& json) { return json.dump(2, ' ', false, kReplace) + "\n"; }
std::string to_utf8(const std::string& text) { return Json::parse(to_line(text)).get<std::string>(); }

}  // namespace radbake::cli

#pragma once

#include <google/protobuf/message.h>

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace radbake::cli {

/// A protobuf message as JSON: fields in the order and with the names of the .proto file.
///
/// Unlike protobuf's own mapping, 64-bit integers are numbers, and a scalar that has its default value is there.
/// Messages and members of a oneof that are not set are left out, and so are bytes (pictures are files). Enums are
/// their names. What JSON has no number for (infinity, NaN) is null.
nlohmann::ordered_json to_json(const google::protobuf::Message& message);

/// One line, or indented by 2 with a newline at the end. Bytes that are not UTF-8 become U+FFFD.
std::string to_line(const nlohmann::ordered_json& json);
std::string to_text(const nlohmann::ordered_json& json);

/// The text with bytes that are not UTF-8 replaced: file names may hold any.
std::string to_utf8(const std::string& text);

}  // namespace radbake::cli

#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <string>
#include <vector>

namespace radbake {

/// Names of all fields, down to the leaves, that hold their default.
inline void collect_unset(const google::protobuf::Message& message, const std::string& prefix,
                          std::vector<std::string>& unset) {
  const auto& reflection = *message.GetReflection();
  std::vector<const google::protobuf::FieldDescriptor*> set_fields;
  reflection.ListFields(message, &set_fields);
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* field = message.GetDescriptor()->field(i);
    const std::string name = prefix + field->name();
    if (std::find(set_fields.begin(), set_fields.end(), field) == set_fields.end()) {
      unset.push_back(name);
    } else if (field->is_repeated() && field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) {
      collect_unset(reflection.GetRepeatedMessage(message, field, 0), name + ".", unset);
    } else if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) {
      collect_unset(reflection.GetMessage(message, field), name + ".", unset);
    }
  }
}

inline std::vector<std::string> unset_fields(const google::protobuf::Message& message) {
  std::vector<std::string> unset;
  collect_unset(message, "", unset);
  return unset;
}

}  // namespace radbake

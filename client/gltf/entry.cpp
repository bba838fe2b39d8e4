#include "client/gltf/entry.h"

#include <algorithm>

namespace radbake::gltf {
namespace {

using nlohmann::json;

// A value of the file in a message: short.
std::string shown(const json& value) {
  if (value.is_object()) return "an object";
  if (value.is_array()) return "an array of " + std::to_string(value.size());
  if (value.is_string()) return in_quotes(value.get_ref<const std::string&>());
  return value.dump();
}

// The reason why a value is not a number in [low, high]; empty if it is one.
std::string number_fault(const json& value, double low, double high) {
  if (!value.is_number()) return shown(value) + ", not a number";
  const double number = value.get<double>();
  if (number >= low && number <= high) return {};
  if (low == 0 && number < 0) return shown(value) + ", but must not be negative";
  return shown(value) + ", outside " + json(low).dump() + " to " + json(high).dump();
}

}  // namespace

std::string printable(std::string_view name) {
  std::string text(name.substr(0, 200));
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, '?');
  return text;
}

std::string in_quotes(std::string_view name) {
  return "'" + printable(name.substr(0, 60)) + (name.size() > 60 ? "...'" : "'");
}

std::string numbered(std::string_view thing, std::size_t index, std::string_view name) {
  std::string text = std::string(thing) + " " + std::to_string(index);
  return name.empty() ? text : text + " " + in_quotes(name);
}

Error Entry::error(const std::string& message) const {
  return invalid_argument(name_.empty() ? message : name_ + ": " + message);
}

const json* Entry::find(const char* key) const {
  const auto it = object_->find(key);
  return it == object_->end() ? nullptr : &*it;
}

Result<std::optional<std::uint64_t>> Entry::whole_number(const char* key, std::uint64_t max) const {
  const json* value = find(key);
  if (value == nullptr) return std::optional<std::uint64_t>();
  if (!value->is_number_unsigned())
    return error(std::string(key) + " is " + shown(*value) + ", not a whole number >= 0");
  const auto number = value->get<std::uint64_t>();
  if (number > max) {
    return error(std::string(key) + " is " + std::to_string(number) + ", above the limit of " + std::to_string(max));
  }
  return std::optional(number);
}

Result<std::uint64_t> Entry::required_whole_number(const char* key, std::uint64_t max) const {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<std::uint64_t> number, whole_number(key, max));
  if (!number) return error(std::string(key) + " is missing");
  return *number;
}

Result<std::optional<std::uint64_t>> Entry::index(const char* key, std::size_t size, const char* list) const {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<std::uint64_t> number, whole_number(key));
  if (number && *number >= size) {
    return error(std::string(key) + " is " + std::to_string(*number) + ", but the file has " + std::to_string(size) +
                 " " + list);
  }
  return number;
}

Result<void> Entry::number(const char* key, double low, double high) const {
  const json* value = find(key);
  if (value == nullptr) return {};
  const std::string fault = number_fault(*value, low, high);
  if (fault.empty()) return {};
  return error(std::string(key) + " is " + fault);
}

Result<void> Entry::numbers(const char* key, std::size_t size, double low, double high) const {
  const json* value = find(key);
  if (value == nullptr) return {};
  if (!value->is_array() || value->size() != size) {
    return error(std::string(key) + " is " + shown(*value) + ", not " + std::to_string(size) + " numbers");
  }
  for (std::size_t i = 0; i < size; ++i) {
    const std::string fault = number_fault((*value)[i], low, high);
    if (!fault.empty()) return error(std::string(key) + "[" + std::to_string(i) + "] is " + fault);
  }
  return {};
}

Result<void> Entry::text(const char* key) const {
  const json* value = find(key);
  if (value == nullptr || value->is_string()) return {};
  return error(std::string(key) + " is " + shown(*value) + ", not a text");
}

Result<void> Entry::flag(const char* key) const {
  const json* value = find(key);
  if (value == nullptr || value->is_boolean()) return {};
  return error(std::string(key) + " is " + shown(*value) + ", not true or false");
}

Result<std::vector<std::uint64_t>> Entry::indices(const char* key, std::size_t size, const char* list) const {
  std::vector<std::uint64_t> numbers;
  const json* value = find(key);
  if (value == nullptr) return numbers;
  if (!value->is_array()) return error(std::string(key) + " is " + shown(*value) + ", not an array");
  for (const json& item : *value) {
    if (!item.is_number_unsigned() || item.get<std::uint64_t>() >= size) {
      return error(std::string(key) + " holds " + shown(item) + ", but the file has " + std::to_string(size) + " " +
                   list);
    }
    numbers.push_back(item.get<std::uint64_t>());
  }
  return numbers;
}

Result<std::optional<Entry>> Entry::member(const char* key) const {
  const json* value = find(key);
  if (value == nullptr) return std::optional<Entry>();
  if (!value->is_object()) return error(std::string(key) + " is " + shown(*value) + ", not an object");
  return std::optional(Entry(*value, name_.empty() ? key : name_ + ", " + key));
}

Result<std::optional<Entry>> Entry::extension(const char* key) const {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> extensions, member("extensions"));
  if (!extensions || extensions->find(key) == nullptr) return std::optional<Entry>();
  const json& value = *extensions->find(key);
  if (!value.is_object()) return error(std::string(key) + " is " + shown(value) + ", not an object");
  return std::optional(Entry(value, name_.empty() ? key : name_ + ", " + key));
}

Result<std::vector<Entry>> Entry::list(const char* key, const char* thing) const {
  std::vector<Entry> entries;
  const json* value = find(key);
  if (value == nullptr) return entries;
  if (!value->is_array()) return error(std::string(key) + " is " + shown(*value) + ", not an array");
  entries.reserve(value->size());
  for (const json& item : *value) {
    std::string name = numbered(thing, entries.size());
    if (!name_.empty()) name = name_ + ", " + name;
    if (!item.is_object()) return invalid_argument(name + " is " + shown(item) + ", not an object");
    const auto label = item.find("name");
    if (label != item.end() && label->is_string() && !label->get_ref<const std::string&>().empty()) {
      name += " " + in_quotes(label->get_ref<const std::string&>());
    }
    entries.emplace_back(item, std::move(name));
  }
  return entries;
}

}  // namespace radbake::gltf

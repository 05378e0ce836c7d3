#include "config/json.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <unordered_set>

#include "config/node.h"
#include "core/error.h"
#include "core/file.h"

namespace catoptric::config {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxDepth = 64;             // scene descriptions nest about 10 levels
constexpr std::size_t kMaxFileBytes = 64u << 20;  // of one description
constexpr const char* kZeroInText = "the character \\u0000 is not allowed in a text";
constexpr std::size_t kShortTextBytes = 60;            // of a value inside a message
constexpr double kExactIntegers = 9007199254740992.0;  // 2^53: doubles count exactly to here

/// Reads the text for nlohmann's parser and remembers how far it has read, so that parse events
/// can be given a line.
class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, const char** farthest) : at_(at), farthest_(farthest) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    ++at_;
    if (farthest_ != nullptr) *farthest_ = at_;
    return *this;
  }
  CountingIterator operator++(int) {
    CountingIterator old = *this;
    ++*this;
    return old;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }
  bool operator!=(const CountingIterator& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** farthest_;
};

/// Builds nodes from parse events.
class Builder {
 public:
  Builder(const std::string& text, const std::string& name)
      : text_(text), name_(name), farthest_(text.data()), counted_(text.data()) {}

  const char** farthest() { return &farthest_; }
  Value takeRoot() { return Value(root_); }

  // Parse events of nlohmann's SAX interface.
  bool null() { return add(node(Value::Kind::Null)); }
  bool boolean(bool value) {
    auto n = node(Value::Kind::Bool);
    n->boolean = value;
    return add(n);
  }
  bool number_integer(Json::number_integer_t value) {
    auto n = numberNode();
    n->number = static_cast<double>(value);
    n->integer = value;
    n->isInteger = true;
    return add(n);
  }
  bool number_unsigned(Json::number_unsigned_t value) {
    auto n = numberNode();
    n->number = static_cast<double>(value);
    n->isInteger =
        value <= static_cast<Json::number_unsigned_t>(std::numeric_limits<std::int64_t>::max());
    n->integer = n->isInteger ? static_cast<std::int64_t>(value) : 0;
    return add(n);
  }
  bool number_float(Json::number_float_t value, const std::string&) {
    auto n = numberNode();
    n->number = value;
    // 512.0 and 5e2 are integers too.
    n->isInteger = std::trunc(value) == value && std::abs(value) <= kExactIntegers;
    n->integer = n->isInteger ? static_cast<std::int64_t>(value) : 0;
    return add(n);
  }
  bool string(std::string& value) {
    auto n = node(Value::Kind::String);
    n->string = std::move(value);
    if (hasZero(n->string)) Value(n).fail(kZeroInText);
    return add(n);
  }
  bool binary(Json::binary_t&) { return false; }
  bool start_object(std::size_t) { return open(Value::Kind::Object); }
  bool end_object() { return close(); }
  bool start_array(std::size_t) { return open(Value::Kind::Array); }
  bool end_array() { return close(); }
  bool key(std::string& value) {
    Level& level = levels_.back();
    level.key = std::move(value);
    if (hasZero(level.key)) {
      level.key.resize(level.key.find('\0'));  // what stands in the message must not end it
      Value(node(Value::Kind::Null)).fail(kZeroInText);
    }
    if (!level.seen.insert(level.key).second) {
      auto n = node(Value::Kind::Null);
      Value(n).fail("duplicate name \"" + level.key + "\"");
    }
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const Json::exception& error) {
    // The parser has just read the character that it could not use.
    const char* at = farthest_ > text_.data() ? farthest_ - 1 : farthest_;
    if (farthest_ == text_.data() + text_.size() && endsInside(error.what())) at = farthest_;
    const char* lineStart = at;
    while (lineStart > text_.data() && lineStart[-1] != '\n') --lineStart;
    throw UsageError(name_ + ":" + std::to_string(lineAt(at)) + ":" +
                     std::to_string(at - lineStart + 1) + ": " +
                     reason(error.what(), lineStart, at));
  }

 private:
  struct Level {
    std::shared_ptr<Value::Node> node;
    std::string key;
    std::unordered_set<std::string> seen;
  };

  /// Names of files end at a zero byte: another file would be opened than the one that is shown.
  static bool hasZero(const std::string& text) { return text.find('\0') != std::string::npos; }

  static bool endsInside(const std::string& message) {
    return message.find("unexpected end of input") != std::string::npos;
  }

  int lineAt(const char* at) {
    if (at < counted_) {
      counted_ = text_.data();
      line_ = 1;
    }
    line_ += static_cast<int>(std::count(counted_, at, '\n'));
    counted_ = at;
    return line_;
  }

  std::string pointer() const {
    std::string text;
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      const Value::Node& container = *levels_[i].node;
      text += '/';
      if (container.kind == Value::Kind::Object) {
        text += escapedPointerToken(levels_[i].key);
      } else {  // an open member is in the array already, a new one not yet
        text += std::to_string(container.array.size() - (i + 1 < levels_.size() ? 1 : 0));
      }
    }
    return text;
  }

  std::string pointerText() const { return levels_.empty() ? "/" : pointer(); }

  std::shared_ptr<Value::Node> nodeAt(Value::Kind kind, const char* at) {
    auto n = std::make_shared<Value::Node>();
    n->kind = kind;
    n->place = {name_, lineAt(at), pointer()};
    return n;
  }
  std::shared_ptr<Value::Node> node(Value::Kind kind) { return nodeAt(kind, farthest_); }
  std::shared_ptr<Value::Node> numberNode() {
    // A number ends where something else begins: one character too many has been read.
    const char* at = farthest_;
    while (at > text_.data() && (at[-1] < '0' || at[-1] > '9')) --at;
    auto n = nodeAt(Value::Kind::Number, at);
    const char* begin = at;
    while (begin > text_.data() && std::strchr("0123456789+-.eE", begin[-1]) != nullptr) --begin;
    n->textRange = {static_cast<std::size_t>(begin - text_.data()),
                    static_cast<std::size_t>(at - text_.data())};
    return n;
  }

  bool add(const std::shared_ptr<Value::Node>& n) {
    if (levels_.empty()) {
      root_ = n;
      return true;
    }
    Level& level = levels_.back();
    if (level.node->kind == Value::Kind::Array) {
      level.node->array.emplace_back(n);
    } else {
      level.node->members.emplace_back(level.key, Value(n));
    }
    return true;
  }
  bool open(Value::Kind kind) {
    auto n = node(kind);
    if (levels_.size() >= kMaxDepth)
      Value(n).fail("nested deeper than the " + std::to_string(kMaxDepth) + " levels allowed");
    add(n);
    levels_.push_back({n, {}, {}});
    return true;
  }
  bool close() {
    levels_.pop_back();
    return true;
  }

  /// nlohmann's message without its prefix, or a plainer one for the usual slips.
  std::string reason(std::string message, const char* lineStart, const char* at) const {
    const char* end = text_.data() + text_.size();
    const char* token = at;
    while (token > lineStart && (std::isalnum(static_cast<unsigned char>(token[-1])) != 0 ||
                                 token[-1] == '/' || token[-1] == '-'))
      --token;
    const std::string_view rest(token, static_cast<std::size_t>(end - token));
    if (rest.starts_with("//") || rest.starts_with("/*") || rest.starts_with("#"))
      return "comments are not allowed in JSON";
    // Where a value is read, its pointer is known
    const bool isValue = message.find("while parsing value") != std::string::npos;
    for (const char* name : {"NaN", "-NaN", "Infinity", "-Infinity", "nan", "inf", "-inf"})
      if (rest.starts_with(name))
        return (isValue ? pointerText() + ": " : "") + name + " is not a number in JSON";
    if (at < end && (*at == '}' || *at == ']')) {
      const char* before = at;
      while (before > text_.data() && std::isspace(static_cast<unsigned char>(before[-1])) != 0)
        --before;
      if (before > text_.data() && before[-1] == ',')
        return "a comma before '" + std::string(1, *at) + "' is not allowed in JSON";
    }
    if (const auto start = message.find("] "); start != std::string::npos)
      message.erase(0, start + 2);
    if (message.starts_with("parse error"))
      if (const auto start = message.find(": "); start != std::string::npos)
        message.erase(0, start + 2);
    if (message.starts_with("number overflow")) return pointerText() + ": " + message;
    return message;
  }

  const std::string& text_;
  const std::string& name_;
  const char* farthest_;
  const char* counted_;
  int line_ = 1;
  std::vector<Level> levels_;
  std::shared_ptr<Value::Node> root_;
};

Json toJson(const Value::Node& node) {
  // Depth is capped by the parser, so this recursion is too.
  switch (node.kind) {
    case Value::Kind::Null:
      break;
    case Value::Kind::Bool:
      return node.boolean;
    case Value::Kind::Number:
      if (node.isInteger) return node.integer;
      return node.number;
    case Value::Kind::String:
      return node.string;
    case Value::Kind::Array: {
      Json array = Json::array();
      for (const Value& item : node.array) array.push_back(toJson(item.node()));
      return array;
    }
    case Value::Kind::Object: {
      Json object = Json::object();
      for (const auto& [name, member] : node.members) object[name] = toJson(member.node());
      return object;
    }
  }
  return nullptr;
}

}  // namespace

std::string escapedPointerToken(const std::string& name) {
  std::string text;
  for (const char c : name) {
    if (c == '~') {
      text += "~0";
    } else if (c == '/') {
      text += "~1";
    } else {
      text += c;
    }
  }
  return text;
}

std::string shortText(const Value& value) {
  std::string text = value.dump();
  if (text.size() > kShortTextBytes) {
    std::size_t end = kShortTextBytes - 3;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0u) == 0x80u) --end;
    text = text.substr(0, end) + "...";
  }
  return text;
}

std::string Place::text() const {
  const std::string where = line > 0 ? file + ":" + std::to_string(line) : file;
  return where + ": " + (pointer.empty() ? "/" : pointer);
}

Value::Value() : node_(std::make_shared<Node>()) {}
Value::Value(std::shared_ptr<const Node> node) : node_(std::move(node)) {}

Value::Kind Value::kind() const {
  return node_->kind;
}
const Place& Value::place() const {
  return node_->place;
}

void Value::fail(const std::string& message) const {
  throw UsageError(place().text() + ": " + message);
}

namespace {
[[noreturn]] void failKind(const Value& value, const std::string& missing, const char* wanted) {
  if (!missing.empty()) value.fail("\"" + missing + "\" is missing; expected " + wanted);
  value.fail(shortText(value) + " is not " + wanted);
}
}  // namespace

bool Value::asBool() const {
  if (kind() != Kind::Bool) failKind(*this, node_->missing, "true or false");
  return node_->boolean;
}
double Value::asNumber() const {
  if (kind() != Kind::Number) failKind(*this, node_->missing, "a number");
  return node_->number;
}
std::int64_t Value::asInteger() const {
  if (kind() != Kind::Number || !node_->isInteger) failKind(*this, node_->missing, "an integer");
  return node_->integer;
}
std::pair<std::size_t, std::size_t> Value::textRange() const {
  return node_->textRange;
}
const std::string& Value::asString() const {
  if (kind() != Kind::String) failKind(*this, node_->missing, "a string");
  return node_->string;
}
const std::vector<Value>& Value::asArray() const {
  if (kind() != Kind::Array) failKind(*this, node_->missing, "an array");
  return node_->array;
}
Vec3 Value::asVec3() const {
  if (kind() != Kind::Array || node_->array.size() != 3)
    failKind(*this, node_->missing, "an array of 3 numbers");
  const std::vector<float> v = asFloats(3);
  return {v[0], v[1], v[2]};
}
std::vector<float> Value::asFloats(std::size_t count) const {
  if (kind() != Kind::Array || node_->array.size() != count)
    failKind(*this, node_->missing, ("an array of " + std::to_string(count) + " numbers").c_str());
  std::vector<float> floats;
  floats.reserve(count);
  for (const Value& item : node_->array) {
    const double number = item.asNumber();
    if (std::abs(number) > static_cast<double>(std::numeric_limits<float>::max()))
      item.fail(shortText(item) + " is too large (the limit is 3.4e38)");
    floats.push_back(static_cast<float>(number));
  }
  return floats;
}

bool Value::has(const std::string& key) const {
  for (const auto& [name, member] : node_->members)
    if (name == key) return true;
  return false;
}

Value Value::get(const std::string& key) const {
  if (kind() == Kind::Object)
    for (const auto& [name, member] : node_->members)
      if (name == key) return member;
  if (kind() != Kind::Object && kind() != Kind::Null) failKind(*this, {}, "an object");
  auto absent = std::make_shared<Node>();
  absent->place = place();
  absent->missing = key;
  return Value(std::move(absent));
}

std::vector<std::string> Value::keys() const {
  if (kind() != Kind::Object) failKind(*this, node_->missing, "an object");
  std::vector<std::string> names;
  names.reserve(node_->members.size());
  for (const auto& [name, member] : node_->members) names.push_back(name);
  return names;
}

std::string Value::dump(int indent) const {
  return toJson(*node_).dump(indent, ' ', false, Json::error_handler_t::replace);
}

Value parseText(const std::string& text, const std::string& name) {
  // nlohmann's parser takes a zero byte for the end of the text, and ignores what follows.
  if (const std::size_t zero = text.find('\0'); zero != std::string::npos)
    throw UsageError(
        name + ":" + std::to_string(1 + std::count(text.data(), text.data() + zero, '\n')) +
        ": byte " + std::to_string(zero) + " of the text is zero, which is not allowed in JSON");
  Builder builder(text, name);
  const char* end = text.data() + text.size();
  Json::sax_parse(CountingIterator(text.data(), builder.farthest()), CountingIterator(end, nullptr),
                  &builder, Json::input_format_t::json, /*strict=*/true, /*ignore_comments=*/false);
  return builder.takeRoot();
}

Value parseFile(const std::filesystem::path& file) {
  std::string text;
  try {
    text = readTextFile(file, kMaxFileBytes);
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
  return parseText(text, file.string());
}

namespace {

std::shared_ptr<Value::Node> copyOf(const Value& value) {
  return std::make_shared<Value::Node>(value.node());  // members are shared
}

Value replaced(const Value& at, const std::vector<std::string>& path, std::size_t depth,
               const std::string& pointer, const Value& value, const Place& setting) {
  if (depth == path.size()) return value;
  const std::string& token = path[depth];
  const std::string inner = pointer + "/" + escapedPointerToken(token);
  if (at.kind() == Value::Kind::Array) {
    auto node = copyOf(at);
    const bool isIndex = !token.empty() && token.size() < 10 &&
                         token.find_first_not_of("0123456789") == std::string::npos;
    const std::size_t index = isIndex ? std::stoul(token) : 0;
    if (!isIndex || index > node->array.size())
      throw UsageError(setting.file + ": " + inner + ": \"" + token +
                       "\" is not an index from 0 to " + std::to_string(node->array.size()) +
                       " (the array at " + at.place().text() + " has " +
                       std::to_string(node->array.size()) + " members)");
    if (index == node->array.size()) node->array.emplace_back();
    node->array[index] = replaced(node->array[index], path, depth + 1, inner, value, setting);
    return Value(node);
  }
  std::shared_ptr<Value::Node> node;
  if (at.kind() == Value::Kind::Object) {
    node = copyOf(at);
  } else if (at.isNull()) {
    node = std::make_shared<Value::Node>();
    node->kind = Value::Kind::Object;
    node->place = {setting.file, 0, pointer};
  } else {
    throw UsageError(setting.file + ": " + inner + ": " + shortText(at) + " at " +
                     at.place().text() + " has no members");
  }
  for (auto& [name, member] : node->members)
    if (name == token) {
      member = replaced(member, path, depth + 1, inner, value, setting);
      return Value(node);
    }
  node->members.emplace_back(token, replaced(Value(), path, depth + 1, inner, value, setting));
  return Value(node);
}

/// The same value, standing at `pointer` of a --set option.
Value relocated(const Value& value, const std::string& file, const std::string& pointer) {
  auto node = copyOf(value);
  node->place = {file, 0, pointer};
  for (std::size_t i = 0; i < node->array.size(); ++i)
    node->array[i] = relocated(node->array[i], file, pointer + "/" + std::to_string(i));
  for (auto& [name, member] : node->members)
    member = relocated(member, file, pointer + "/" + escapedPointerToken(name));
  return Value(node);
}

}  // namespace

Value withSetting(const Value& root, const std::string& dottedPath, const std::string& valueText,
                  const std::string& origin) {
  const Place setting{origin.empty() ? "--set " + dottedPath + "=" + valueText : origin, 0, ""};
  std::vector<std::string> path;
  std::string pointer;
  for (std::size_t start = 0; start <= dottedPath.size();) {
    const std::size_t dot = std::min(dottedPath.find('.', start), dottedPath.size());
    path.push_back(dottedPath.substr(start, dot - start));
    if (path.back().empty())
      throw UsageError(setting.file +
                       ": the name of a value must be names joined by dots, such as image.width or "
                       "methods.0.bvh");
    pointer += "/" + escapedPointerToken(path.back());
    start = dot + 1;
  }
  Value value;
  try {
    value = parseText(valueText, setting.file);
  } catch (const UsageError&) {
    auto text = std::make_shared<Value::Node>();
    text->kind = Value::Kind::String;
    text->string = valueText;
    value = Value(text);
  }
  return replaced(root, path, 0, "", relocated(value, setting.file, pointer), setting);
}

Value without(const Value& object, const std::vector<std::string>& names) {
  auto node = copyOf(object);
  std::erase_if(node->members, [&](const auto& member) {
    return std::find(names.begin(), names.end(), member.first) != names.end();
  });
  return Value(node);
}

}  // namespace catoptric::config

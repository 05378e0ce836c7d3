#include "study/axes.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>

#include "config/json_text.h"
#include "core/error.h"
#include "core/text.h"

namespace catoptric::study {
namespace {

constexpr int kMostValues = 1000;  ///< of one axis; ours

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::optional<double> numberOf(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

/// Parts of a list; what stands in brackets or quotes is not split.
std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  int depth = 0;
  bool quoted = false;
  for (const char letter : text) {
    if (letter == '"') quoted = !quoted;
    if (!quoted && (letter == '[' || letter == '{')) ++depth;
    if (!quoted && (letter == ']' || letter == '}')) --depth;
    if (letter == separator && depth == 0 && !quoted)
      parts.emplace_back();
    else
      parts.back() += letter;
  }
  return parts;
}

/// "a..b:n" as numbers; six digits, so that 0.1 is 0.1.
std::vector<std::string> rangeValues(const std::string& axis, const std::string& range, bool log) {
  const auto fail = [&](const std::string& why) -> void {
    throw UsageError("--vary " + axis + ": " + why + "; a range is written FROM..TO:COUNT, as in " +
                     "0..1:5 or log:0.1..10:7");
  };
  const std::size_t dots = range.find("..");
  const std::size_t colon = range.find(':', dots);
  if (colon == std::string::npos) fail("\"" + range + "\" has no count");
  const std::optional<double> from = numberOf(range.substr(0, dots));
  const std::optional<double> to = numberOf(range.substr(dots + 2, colon - dots - 2));
  const std::optional<double> count = numberOf(range.substr(colon + 1));
  if (!from || !to || !count) fail("\"" + range + "\" is not made of numbers");
  if (*count < 2 || *count > kMostValues || *count != std::floor(*count))
    fail("the count must be a whole number from 2 to " + std::to_string(kMostValues));
  if (!(*from < *to))
    fail("the range " + range.substr(0, colon) + " must run from a smaller to a larger number");
  if (log && *from <= 0.0) fail("a log: range must begin above 0");
  std::vector<std::string> values;
  const int steps = static_cast<int>(*count) - 1;
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    double value = log ? *from * std::pow(*to / *from, share) : std::lerp(*from, *to, share);
    values.push_back(fmt::format("{:.6g}", value));
  }
  return values;
}

std::string lastPart(const std::string& name) {
  return name.substr(name.rfind('.') + 1);
}

/// "second_order" of "methods.second_order.rays"; empty when it is no method's.
std::string methodOf(const std::string& name) {
  constexpr std::string_view kMethods = "methods.";
  if (!name.starts_with(kMethods)) return "";
  const std::size_t dot = name.find('.', kMethods.size());
  return name.substr(kMethods.size(), dot == std::string::npos ? dot : dot - kMethods.size());
}

}  // namespace

Axis parseAxis(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = trimmed(text.substr(0, equals));
  if (equals == std::string::npos || name.empty())
    throw UsageError("--vary \"" + text +
                     "\": must be NAME=VALUES, such as methods.traced.rays=1,4,16");
  std::string list = trimmed(text.substr(equals + 1));
  Axis axis{{name}, {}, methodOf(name)};
  const bool log = list.starts_with("log:");
  if (log) list = list.substr(4);
  std::vector<std::string> values;
  if (log || (list.find("..") != std::string::npos && numberOf(list.substr(0, list.find("..")))))
    values = rangeValues(name, list, log);
  else
    for (const std::string& part : split(list, ',')) values.push_back(trimmed(part));
  std::set<std::string> known;
  for (const std::string& value : values) {
    if (value.empty())
      throw UsageError("--vary " + text + ": a value is empty; write \"\" for an empty text");
    if (!known.insert(value).second)
      throw UsageError("--vary " + text + ": " + value + " is given twice");
    axis.values.push_back({value});
  }
  return axis;
}

std::vector<Axis> automaticAxes(const std::string& name, const config::Schema& schema,
                                const config::Value& effective) {
  std::vector<Axis> axes;
  for (const config::Field& field : schema.fields) {
    if (field.trade.empty()) continue;
    Axis axis{{"methods." + name + "." + field.name}, {}, name};
    std::vector<std::string> values = split(field.trade, ',');
    const config::Value own = effective.get(field.name);
    const std::string text =
        own.kind() == config::Value::Kind::String ? own.asString() : own.dump();
    const std::optional<double> ownNumber = numberOf(text);
    const auto isOwn = [&](const std::string& value) {
      return value == text || (ownNumber && numberOf(value) == ownNumber);
    };
    if (std::ranges::none_of(values, isOwn)) {
      const auto after = std::ranges::find_if(values, [&](const std::string& value) {
        const std::optional<double> number = numberOf(value);
        return number && ownNumber && *number > *ownNumber;
      });
      values.insert(after, text);
    }
    for (std::string& value : values) axis.values.push_back({std::move(value)});
    axes.push_back(std::move(axis));
  }
  return axes;
}

void linkAxes(std::vector<Axis>& axes, const std::string& link) {
  std::vector<std::string> all;
  for (const Axis& axis : axes) all.insert(all.end(), axis.names.begin(), axis.names.end());
  std::optional<std::size_t> first;
  const std::vector<std::string> wanted = split(link, ',');
  if (wanted.size() < 2)
    throw UsageError("--link " + link +
                     ": must be two or more names of --vary, separated by commas");
  for (const std::string& part : wanted) {
    const std::string name = trimmed(part);
    const auto found = std::find_if(axes.begin(), axes.end(), [&](const Axis& axis) {
      return std::find(axis.names.begin(), axis.names.end(), name) != axis.names.end();
    });
    if (found == axes.end())
      throw UsageError("--link " + link + ": no --vary is called \"" + name + "\"" +
                       didYouMean(name, all) + "; there are " + joined(all, ", "));
    const auto index = static_cast<std::size_t>(found - axes.begin());
    if (!first) {
      first = index;
      continue;
    }
    if (index == *first) continue;
    Axis& into = axes[*first];
    if (into.values.size() != found->values.size())
      throw UsageError("--link " + link + ": " + into.names.front() + " has " +
                       std::to_string(into.values.size()) + " values, " + name + " has " +
                       std::to_string(found->values.size()));
    into.names.insert(into.names.end(), found->names.begin(), found->names.end());
    for (std::size_t i = 0; i < into.values.size(); ++i)
      into.values[i].insert(into.values[i].end(), found->values[i].begin(), found->values[i].end());
    if (into.method != found->method) into.method.clear();
    axes.erase(found);
    if (index < *first) --*first;
  }
}

Condition::Condition(const std::string& text, const std::vector<Axis>& axes) : text_(text) {
  std::vector<std::string> names;
  for (const Axis& axis : axes) names.insert(names.end(), axis.names.begin(), axis.names.end());
  const auto resolve = [&](const std::string& word) {
    if (numberOf(word)) return word;
    std::vector<std::string> fitting;
    for (const std::string& name : names)
      if (name == word || lastPart(name) == word) fitting.push_back(name);
    if (fitting.size() == 1) return fitting.front();
    if (fitting.size() > 1)
      throw UsageError("--where " + text + ": \"" + word + "\" may be " + joined(fitting, " or "));
    throw UsageError("--where " + text + ": no --vary is called \"" + word + "\"" +
                     didYouMean(word, names) + "; there are " + joined(names, ", "));
  };
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find("&&", begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    const std::size_t sign = part.find_first_of("<>=!");
    const std::size_t after = part.find_first_not_of("<>=!", sign);
    const std::string symbol = sign == std::string::npos ? "" : part.substr(sign, after - sign);
    const std::set<std::string> allowed{"<", "<=", ">", ">=", "==", "!="};
    if (!allowed.contains(symbol) || after == std::string::npos)
      throw UsageError("--where " + text + ": \"" + trimmed(part) +
                       "\" is not a comparison; allowed: < <= > >= == !=, joined by &&");
    all_.push_back(
        {resolve(trimmed(part.substr(0, sign))), symbol, resolve(trimmed(part.substr(after)))});
    begin = end + 2;
  }
}

bool Condition::holds(const std::map<std::string, std::string>& settings) const {
  const auto valueOf = [&](const std::string& word) -> std::optional<double> {
    if (const std::optional<double> number = numberOf(word)) return number;
    const auto found = settings.find(word);
    if (found == settings.end()) return {};  // of another method
    const std::optional<double> number = numberOf(found->second);
    if (!number)
      throw UsageError("--where " + text_ + ": " + word + "=" + found->second +
                       " is not a number, and cannot be compared");
    return number;
  };
  return std::all_of(all_.begin(), all_.end(), [&](const Comparison& one) {
    const std::optional<double> a = valueOf(one.left);
    const std::optional<double> b = valueOf(one.right);
    if (!a || !b) return true;
    if (one.sign == "<") return *a < *b;
    if (one.sign == "<=") return *a <= *b;
    if (one.sign == ">") return *a > *b;
    if (one.sign == ">=") return *a >= *b;
    return (one.sign == "==") == (*a == *b);
  });
}

std::vector<Point> makePoints(const std::vector<std::string>& methods,
                              const std::vector<Axis>& axes,
                              const std::vector<Condition>& conditions) {
  std::set<std::string> names;
  for (const Axis& axis : axes) {
    for (const std::string& name : axis.names)
      if (!names.insert(name).second) throw UsageError("--vary " + name + " is given twice");
    if (!axis.method.empty() &&
        std::find(methods.begin(), methods.end(), axis.method) == methods.end())
      throw UsageError("--vary " + axis.names.front() + ": the study has no method \"" +
                       axis.method + "\"" + didYouMean(axis.method, methods) + "; it has " +
                       joined(methods, ", "));
  }
  // What all methods have in common is outermost, so that groups stay together.
  const auto widen = [](std::vector<Point>& points, const Axis& axis) {
    std::vector<Point> wider;
    for (const Point& point : points)
      for (const std::vector<std::string>& value : axis.values) {
        wider.push_back(point);
        for (std::size_t i = 0; i < value.size(); ++i) {
          if (axis.names[i] == "program")
            wider.back().program = value[i];
          else
            wider.back().settings.emplace_back(axis.names[i], value[i]);
        }
      }
    points = std::move(wider);
  };
  std::vector<Point> points;
  // Points before the method's own axes: one for each combination of the common ones.
  std::vector<Point> open(1);
  for (const Axis& axis : axes)
    if (axis.method.empty()) widen(open, axis);
  for (Point& point : open) point.group = settingsText(point.settings);
  for (const Point& start : open)
    for (const std::string& method : methods) {
      std::vector<Point> own{start};
      own.front().method = method;
      for (const Axis& axis : axes)
        if (axis.method == method) widen(own, axis);
      points.insert(points.end(), own.begin(), own.end());
    }
  std::erase_if(points, [&](const Point& point) {
    const std::map<std::string, std::string> settings(point.settings.begin(), point.settings.end());
    return !std::all_of(conditions.begin(), conditions.end(),
                        [&](const Condition& condition) { return condition.holds(settings); });
  });
  if (points.empty()) throw UsageError("no combination satisfies --where");
  return points;
}

std::string settingsText(const Settings& settings) {
  std::string text;
  for (const auto& [name, value] : settings)
    text += (text.empty() ? "" : " ") + lastPart(name) + "=" + value;
  return text;
}

}  // namespace catoptric::study

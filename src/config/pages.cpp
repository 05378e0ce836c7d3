#include "config/pages.h"

#include <algorithm>

#include "core/text.h"

namespace catoptric::config {

void SharedLines::add(const std::string& owner, const std::string& line) {
  const auto same = std::find_if(lines_.begin(), lines_.end(),
                                 [&](const Line& known) { return known.text == line; });
  if (same == lines_.end())
    lines_.push_back({line, {owner}});
  else
    same->owners.push_back(owner);
}

std::string SharedLines::shared() const {
  std::vector<std::vector<std::string>> groups;
  std::string text;
  for (const Line& first : lines_) {
    const std::vector<std::string>& owners = first.owners;
    if (owners.size() < 2 || std::find(groups.begin(), groups.end(), owners) != groups.end())
      continue;
    groups.push_back(owners);
    text += "\n**" + joined(owners, ", ") + "**\n\n";
    for (const Line& line : lines_)
      if (line.owners == owners) text += line.text;
  }
  return text;
}

std::string SharedLines::of(const std::string& owner, const std::string& place) const {
  std::string text;
  bool sharesSome = false;
  for (const Line& line : lines_) {
    if (std::find(line.owners.begin(), line.owners.end(), owner) == line.owners.end()) continue;
    if (line.owners.size() == 1)
      text += line.text;
    else
      sharesSome = true;
  }
  return text + (sharesSome ? "- [Shared](" + place + ")\n" : "");
}

}  // namespace catoptric::config

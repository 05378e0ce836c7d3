#include "nightly/junit.h"

#include <map>

#include "core/text.h"
#include "nightly/summary.h"
#include "report/html.h"

namespace catoptric::nightly {
namespace {

/// Servers refuse larger files; messages are cut long before. Ours.
constexpr std::size_t kMostMessage = 2000;

struct TestCase {
  std::string name;
  std::string text;
  Outcome outcome = Outcome::Good;
};

/// Lines of the same kind of a case together: names stay the same from night to night.
std::map<std::pair<std::string, std::string>, TestCase> testCases(
    const std::vector<Verdict>& verdicts) {
  std::map<std::pair<std::string, std::string>, TestCase> cases;
  for (const Verdict& verdict : verdicts) {
    TestCase& one = cases[{verdict.name, verdict.kind}];
    one.name = verdict.kind;
    const Outcome outcome = outcomeOf(verdict);
    one.outcome = std::max(one.outcome, outcome);
    if (outcome == Outcome::Good) continue;
    std::string line = verdict.status;
    if (verdict.frame != 0) line += ", frame " + std::to_string(verdict.frame);
    line += ": " + verdict.message;
    if (verdict.acknowledgement != 0)
      line += " (acknowledged, number " + std::to_string(verdict.acknowledgement) + ")";
    if (verdict.began != 0 && verdict.outcome != Outcome::Skipped)
      line += " (since night " + std::to_string(verdict.began) + ")";
    if (one.text.size() + line.size() < kMostMessage) one.text += line + "\n";
  }
  return cases;
}

}  // namespace

std::string xmlSafe(const std::string& text) {
  std::string safe;
  for (const char c : printable(text)) {
    const auto code = static_cast<unsigned char>(c);
    if (code >= 0x20 || c == '\n' || c == '\t') safe += c;
  }
  return report::xmlText(safe);
}

std::string junitXml(const Night& night, const std::vector<Verdict>& verdicts) {
  const auto cases = testCases(verdicts);
  int failures = 0;
  int errors = 0;
  int skipped = 0;
  std::string body;
  for (const auto& [key, one] : cases) {
    body +=
        "  <testcase classname=\"" + xmlSafe(key.first) + "\" name=\"" + xmlSafe(one.name) + "\"";
    if (one.outcome == Outcome::Good) {
      body += "/>\n";
      continue;
    }
    const char* tag = one.outcome == Outcome::Crash        ? "error"
                      : one.outcome == Outcome::Regression ? "failure"
                                                           : "skipped";
    errors += one.outcome == Outcome::Crash ? 1 : 0;
    failures += one.outcome == Outcome::Regression ? 1 : 0;
    skipped += one.outcome == Outcome::Skipped ? 1 : 0;
    const std::string first = one.text.substr(0, one.text.find('\n'));
    body += ">\n    <" + std::string(tag) + " message=\"" + xmlSafe(first) + "\">" +
            xmlSafe(one.text) + "</" + tag + ">\n  </testcase>\n";
  }
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"" + xmlSafe(night.suite) +
         "\" tests=\"" + std::to_string(cases.size()) + "\" failures=\"" +
         std::to_string(failures) + "\" errors=\"" + std::to_string(errors) + "\" skipped=\"" +
         std::to_string(skipped) + "\" timestamp=\"" +
         xmlSafe(night.started.substr(0, night.started.find('Z'))) + "\" hostname=\"" +
         xmlSafe(night.machine) + "\">\n" + body + "</testsuite>\n";
}

}  // namespace catoptric::nightly

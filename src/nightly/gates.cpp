#include "nightly/gates.h"

#include <algorithm>

#include "config/fields.h"
#include "core/error.h"
#include "study/frame_errors.h"

namespace catoptric::nightly {
namespace {

using config::Schema, config::Value;

config::Field share(const std::string& name, const std::string& help) {
  return config::fields::number(name, help, "", 0.0);
}

std::string meaningOf(const std::string& measure) {
  if (measure == "hdr_flip_q3") return "third quartile of HDR-FLIP, weighted";
  if (measure == "worst_tile") return "largest L1_8bit of 16 x 16 pixels";
  if (measure == "worst_reflector") return "largest L1_8bit of a reflector";
  const auto known = std::ranges::find(study::metrics(), measure, &study::MetricInfo::name);
  if (known == study::metrics().end()) throw Error(ExitCode::Internal, "no meaning of " + measure);
  return known->meaning;
}

}  // namespace

const Schema& gatesSchema() {
  static const Schema schema = [] {
    Schema gates{.name = "gates",
                 .help = "What a night may differ by.",
                 .fields = {share("time", "Longer than the accepted build, percent."),
                            share("memory", "More memory than the accepted build, percent."),
                            share("disk", "Larger frames than the accepted ones, percent."),
                            share("flicker",
                                  "More flicker against the reference frames than the accepted "
                                  "frames have, display steps."),
                            share("again", "Tonight's build against itself, percent."),
                            share("watch_rise", "Rise of a watched counter, percent."),
                            config::fields::arrayOf("watch", "Counters that may not rise.",
                                                    config::FieldType::String)}};
    for (const auto& [name, limit] : Gates().picture)
      gates.fields.push_back(share(name, "Limit of a picture's " + meaningOf(name) + "."));
    return gates;
  }();
  return schema;
}

Gates readGates(const Value& value) {
  Gates gates;
  if (value.isNull()) return gates;
  const auto percent = [&](const char* name, double& share) {
    if (value.has(name)) share = value.get(name).asNumber() / 100.0;
  };
  percent("time", gates.time);
  percent("memory", gates.memory);
  percent("disk", gates.disk);
  percent("again", gates.again);
  percent("watch_rise", gates.watchRise);
  if (value.has("flicker")) gates.flicker = value.get("flicker").asNumber();
  for (auto& [name, limit] : gates.picture)
    if (value.has(name)) limit = value.get(name).asNumber();
  if (value.has("watch")) {
    gates.watch.clear();
    for (const Value& name : value.get("watch").asArray()) gates.watch.push_back(name.asString());
  }
  return gates;
}

}  // namespace catoptric::nightly

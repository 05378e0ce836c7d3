#include "run/stage/mixed_method.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/log.h"
#include "core/text.h"
#include "methods/contract/keeps.h"
#include "methods/shared/reflectors.h"
#include "methods/shared/share.h"
#include "run/folder/plan.h"

namespace catoptric::run {
namespace {

using methods::MethodEntry;
using raster::SampleClass;

/// A method and its reflectors.
struct Part {
  std::string label;   ///< the method's id, numbered where it occurs with several options
  std::string prefix;  ///< of its steps and counters: empty for the entry's own method
  std::string id;
  std::string effective;  ///< options, canonical
  std::unique_ptr<methods::Method> method;
  std::vector<bool> own;             ///< by index of objects
  std::vector<std::string> because;  ///< what the config says of them
  std::string fills;                 ///< line of the plan
  bool takesUnsupported = false;     ///< fills what others cannot do
  bool takesLeft = false;            ///< renders the samples that the part before it leaves
  std::vector<std::string> tables;   ///< that its method can have
  bool renamesTables = false;        ///< an earlier part has tables of these names
};

/// A kind of reflectors, as `reflectors` names it.
struct ReflectorKind {
  std::string_view name;
  SampleClass samples;
};
constexpr std::array<ReflectorKind, 3> kReflectorKinds = {{{"planar", SampleClass::PlanarMirror},
                                                           {"curved", SampleClass::CurvedMirror},
                                                           {"glossy", SampleClass::Glossy}}};

std::string quoted(const std::string& name) {
  return "\"" + name + "\"";
}

class MixedMethod : public methods::Method, public methods::KeepsFrames {
 public:
  explicit MixedMethod(std::vector<Part> parts) : parts_(std::move(parts)) {}

  std::vector<methods::Unsupported> unsupported(const scene::Scene& scene) const override {
    std::vector<methods::Unsupported> all;
    for (const Part& part : parts_) {
      for (methods::Unsupported& one : part.method->unsupported(scene)) {
        if (one.object == 0 || part.own[static_cast<std::size_t>(one.object) - 1])
          all.push_back({one.object, part.label + ": " + one.reason});
      }
    }
    return all;
  }

  methods::MethodPlan plan(const scene::Scene& scene,
                           const methods::RunSettings& settings) const override {
    methods::MethodPlan all;
    all.gbuffer = true;
    for (const Part& part : parts_) {
      const methods::MethodPlan own = part.method->plan(scene, settingsOf(part, settings));
      all.trace = all.trace || own.trace;
      all.masks |= own.masks;
      all.bvh = std::max(all.bvh, own.bvh);  // the one that follows motion more closely
      if (part.takesLeft) all.masks |= raster::kMaskFallback;
      if (own.bounces > 0 && fillsBody(part, scene) &&
          (all.bounces == 0 || own.bounces < all.bounces))
        all.bounces = own.bounces;
      all.items.push_back({"method", part.label, part.fills, 0});
      if (part.takesLeft && settings.masks)
        all.items.push_back({"resource", part.prefix + "masks before it", "R16UI by sample",
                             2 * settings.sampleCount()});
      for (methods::PlanItem item : own.items) {
        item.name = part.prefix + item.name;
        all.items.push_back(std::move(item));
      }
    }
    return all;
  }

  void prepare(methods::Services& services, const methods::RunSettings& settings) override {
    masks_ = settings.masks;
    for (const Part& part : parts_) {
      const frame::StepTimer::Prefix prefix(services.timer, part.prefix);
      part.method->prepare(services, settingsOf(part, settings));
      shares_.emplace_back(services.scene.objects.size(), frame::ObjectSet(part.own));
      if (part.takesLeft && masks_) masksBefore_ = methods::MasksBefore(*services.gbuffer);
    }
  }

  void render(const methods::FrameInput& input, methods::Services& services,
              methods::FrameOutput& output) override {
    if (masks_) services.gbuffer->reflectionFramebuffer.clearColorUint(1, 0);
    methods::FrameInput whole = input;
    whole.changedSamples.reset();  // others have written beside a part's own samples
    gl::Texture* left = nullptr;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      const frame::StepTimer::Prefix prefix(services.timer, part.prefix);
      methods::FrameOutput own;
      if (part.takesLeft) output.counters["fallback_samples"] = 0;
      if (part.takesLeft && left == nullptr) continue;
      if (part.takesLeft && masks_) masksBefore_.keep(*services.gbuffer);
      std::optional<methods::OnlyLeftSamples> only;
      if (part.takesLeft) only.emplace(*services.gbuffer, *left);
      shares_[i].hideOthers(*services.gbuffer);
      if (part.takesUnsupported || part.takesLeft)
        output.counters[part.takesUnsupported ? "unsupported_reflector" : "fallback_samples"] +=
            shares_[i].countShown(*services.gbuffer);
      part.method->render(whole, services, own);
      shares_[i].showAll(*services.gbuffer);
      only.reset();
      if (part.takesLeft && masks_) masksBefore_.add(*services.gbuffer, *left);
      left = own.left;
      take(part, std::move(own), output);
    }
  }

  bool restartsAt(const scene::CameraPath& path, int number) const override {
    return std::ranges::all_of(
        parts_, [&](const Part& part) { return part.method->restartsAt(path, number); });
  }

  std::string keeps() const override {
    std::set<std::string> kept;
    for (const Part& part : parts_) kept.insert(methods::keepsOf(*part.method));
    kept.erase("");
    return joined(std::vector<std::string>(kept.begin(), kept.end()), " and ");
  }

 private:
  static bool fillsBody(const Part& part, const scene::Scene& scene) {
    for (std::size_t i = 0; i < part.own.size(); ++i)
      if (part.own[i] && refractsAsBody(scene, scene.objects[i])) return true;
    return false;
  }

  methods::RunSettings settingsOf(const Part& part, const methods::RunSettings& settings) const {
    methods::RunSettings own = settings;
    own.reflectors = frame::ObjectSet(part.own);
    own.leavesSamples = &part != &parts_.back() && (&part + 1)->takesLeft;
    return own;
  }

  /// Counters of methods beside the entry's own are named after them; so are layers of a method
  /// that is there twice, and tables that an earlier one has, too.
  static void take(const Part& part, methods::FrameOutput own, methods::FrameOutput& output) {
    for (const auto& [name, count] : own.counters) output.counters[part.prefix + name] += count;
    for (methods::Table& table : own.tables) {
      if (part.renamesTables) table.rename(part.prefix + table.name());
      output.tables.push_back(std::move(table));
    }
    for (methods::SampleLayer& layer : own.sampleLayers) {
      if (part.label != part.id) layer.name = part.prefix + layer.name;
      output.sampleLayers.push_back(std::move(layer));
    }
  }

  std::vector<Part> parts_;
  std::vector<methods::Share> shares_;  ///< one per part
  methods::MasksBefore masksBefore_;
  bool masks_ = false;
};

/// Puts the reflectors of one scene into the parts of a mixture.
class Assignment {
 public:
  Assignment(const MethodConfig& config, const scene::Scene& scene,
             const methods::RunSettings& settings, const std::vector<MethodEntry>& registry)
      : config_(config), scene_(scene), settings_(settings), registry_(registry) {
    const methods::Reflectors found = methods::findReflectors(scene, settings.reflectors);
    classes_ = found.classOf;
    reflective_ = found.reflects();
    partOf(config.id, config.options, config.effective,
           "reflectors for which no other method is given");
  }

  /// Methods that render whole images cannot share one, even where no reflector is theirs.
  void requireSamples() const {
    const auto shares = [&](const std::string& id, const config::Value& options) {
      return entryOf(id).make(options)->plan(scene_, settings_).gbuffer;
    };
    const std::string why = " renders only whole images; it cannot be used in \"reflectors\"";
    for (const ReflectorRule& rule : config_.reflectors)
      if (!shares(rule.id, rule.options)) rule.place.fail(rule.id + why);
    if (!config_.reflectors.empty() && !shares(config_.id, config_.options))
      config_.place.fail(config_.id + why);
    for (const MethodConfig& fallback : config_.fallback)
      if (!shares(fallback.id, fallback.options))
        fallback.place.fail(fallback.id +
                            " renders only whole images; it cannot be a \"fallback\"");
  }

  void byNames() {
    for (const ReflectorRule& rule : config_.reflectors)
      kindOf(rule.pattern) == SampleClass::Diffuse ? checkName(rule) : checkKind(rule);
    for (std::size_t i = 0; i < reflective_.size(); ++i) {
      if (!reflective_[i]) continue;
      const ReflectorRule* rule = ruleFor(i);
      Part& part = rule == nullptr
                       ? parts_.front()
                       : partOf(rule->id, rule->options, rule->effective, quoted(rule->pattern));
      part.own[i] = true;
    }
  }

  /// What its part's method cannot do goes to the method that `unsupported` names.
  void unsupported() {
    if (config_.unsupported == "error") return;
    std::vector<bool> moved(reflective_.size(), false);
    for (const Part& part : parts_) {
      for (const methods::Unsupported& one : part.method->unsupported(scene_)) {
        if (one.object > 0 && part.own[static_cast<std::size_t>(one.object) - 1])
          moved[static_cast<std::size_t>(one.object) - 1] = true;
      }
    }
    if (std::ranges::find(moved, true) == moved.end()) return;
    for (Part& part : parts_)
      for (std::size_t i = 0; i < moved.size(); ++i) part.own[i] = part.own[i] && !moved[i];
    Part fallback =
        makePart(config_.unsupported,
                 config::parseText(entryOf(config_.unsupported).fallbackOptions, "unsupported"));
    fallback.takesUnsupported = true;
    fallback.own = std::move(moved);
    fallback.because = {"reflectors that their method cannot render, by \"unsupported\""};
    parts_.push_back(std::move(fallback));
  }

  /// What the entry's method leaves goes to the method of `fallback`.
  void left() {
    for (const MethodConfig& config : config_.fallback) {
      methods::RunSettings settings = settings_;
      settings.reflectors = frame::ObjectSet(parts_.front().own);
      Part rest = partOfMethod(config.id, makeMethod(config, scene_, settings, registry_));
      for (const ReflectorRule& rule : config.reflectors) addTables(rest, rule.id);
      rest.takesLeft = true;
      rest.own = parts_.front().own;
      rest.because = {"samples that " + config_.id + " leaves"};
      parts_.insert(parts_.begin() + 1, std::move(rest));
    }
  }

  /// Those that fill something; the entry's own stays beside others, so that it counts its zeros.
  std::vector<Part> take() {
    const auto fills = [](const Part& part) {
      return std::ranges::find(part.own, true) != part.own.end();
    };
    parts_.erase(std::remove_if(parts_.begin() + 1, parts_.end(),
                                [&](const Part& part) { return !fills(part); }),
                 parts_.end());
    if (parts_.size() == 2 && !fills(parts_.front()) && !parts_.back().takesUnsupported)
      parts_.erase(parts_.begin());
    for (Part& part : parts_) {
      part.fills = shown(part) + " (" + joined(part.because, ", ") + ")";
      const auto same = std::ranges::count_if(
          parts_, [&](const Part& other) { return &other < &part && other.id == part.id; });
      part.label = part.id + (same == 0 ? "" : "_" + std::to_string(same + 1));
      if (&part != &parts_.front()) part.prefix = part.label + ".";
      part.renamesTables = std::ranges::any_of(parts_, [&](const Part& other) {
        return &other < &part &&
               std::ranges::find_first_of(other.tables, part.tables) != other.tables.end();
      });
    }
    return std::move(parts_);
  }

 private:
  const MethodEntry& entryOf(const std::string& id) const {
    const auto entry = std::ranges::find(registry_, id, &MethodEntry::id);
    if (entry == registry_.end()) throw Error(ExitCode::Internal, "there is no method " + id);
    return *entry;
  }

  Part makePart(const std::string& id, const config::Value& options) const {
    return partOfMethod(id, entryOf(id).make(options));
  }

  Part partOfMethod(const std::string& id, std::unique_ptr<methods::Method> method) const {
    Part part;
    part.id = id;
    part.method = std::move(method);
    addTables(part, id);
    part.own.assign(reflective_.size(), false);
    return part;
  }

  void addTables(Part& part, const std::string& id) const {
    for (const methods::TableInfo& table : entryOf(id).tables) part.tables.push_back(table.name);
  }

  Part& partOf(const std::string& id, const config::Value& options, const std::string& effective,
               const std::string& because) {
    auto found = std::ranges::find_if(
        parts_, [&](const Part& part) { return part.id == id && part.effective == effective; });
    if (found == parts_.end()) {
      parts_.push_back(makePart(id, options));
      parts_.back().effective = effective;
      found = parts_.end() - 1;
    }
    if (std::ranges::find(found->because, because) == found->because.end())
      found->because.push_back(because);
    return *found;
  }

  /// The sample class of the kind that a pattern names; Diffuse: it names objects.
  static SampleClass kindOf(const std::string& pattern) {
    const auto* const kind = std::ranges::find(kReflectorKinds, pattern, &ReflectorKind::name);
    return kind == kReflectorKinds.end() ? SampleClass::Diffuse : kind->samples;
  }

  static bool matches(const std::string& pattern, const std::string& name) {
    return pattern.ends_with('*')
               ? name.starts_with(std::string_view(pattern).substr(0, pattern.size() - 1))
               : name == pattern;
  }

  bool applies(const ReflectorRule& rule, std::size_t object) const {
    const SampleClass kind = kindOf(rule.pattern);
    return kind == SampleClass::Diffuse ? matches(rule.pattern, scene_.objects[object].name)
                                        : kind == classes_[object + 1];
  }

  /// A name is stronger than a pattern, a long pattern than a short one, a kind than "*" alone.
  const ReflectorRule* ruleFor(std::size_t object) const {
    const auto strength = [](const ReflectorRule& rule) {
      if (kindOf(rule.pattern) != SampleClass::Diffuse) return std::pair(1, std::size_t{0});
      const int rank = !rule.pattern.ends_with('*') ? 3 : rule.pattern.size() > 1 ? 2 : 0;
      return std::pair(rank, rule.pattern.size());
    };
    const ReflectorRule* best = nullptr;
    for (const ReflectorRule& rule : config_.reflectors)
      if (applies(rule, object) && (best == nullptr || strength(rule) > strength(*best)))
        best = &rule;
    return best;
  }

  /// A kind that no reflector has is no error: one entry can serve several scenes.
  void checkKind(const ReflectorRule& rule) const {
    if (std::ranges::find(scene_.objects, rule.pattern, &scene::Object::name) !=
        scene_.objects.end())
      rule.place.fail(quoted(rule.pattern) + " is both a kind of reflectors and the name of an " +
                      "object; for the object, write " + quoted(rule.pattern + "*"));
    if (std::ranges::find(classes_, kindOf(rule.pattern)) == classes_.end())
      log::info("no reflector of this scene is of the kind " + quoted(rule.pattern));
  }

  void checkName(const ReflectorRule& rule) const {
    std::vector<std::string> names;
    bool any = false;
    for (std::size_t i = 0; i < reflective_.size(); ++i) {
      const std::string& name = scene_.objects[i].name;
      if (matches(rule.pattern, name)) {
        if (reflective_[i]) return;
        any = true;
      }
      if (reflective_[i]) names.push_back(name);
    }
    std::ranges::sort(names);
    names.erase(std::unique(names.begin(), names.end()), names.end());
    std::string allowed = "; nothing in this scene reflects";
    if (!names.empty()) {
      std::vector<std::string> kinds;
      for (const ReflectorKind& kind : kReflectorKinds) kinds.emplace_back(kind.name);
      allowed = "; the reflective objects are " + joined(names, ", ") + "; the kinds are " +
                joined(kinds, ", ");
      names.insert(names.end(), kinds.begin(), kinds.end());
    }
    if (any)
      rule.place.fail(quoted(rule.pattern) + " does not reflect: its material has s = 0" + allowed);
    rule.place.fail("no object of the scene is called " + quoted(rule.pattern) +
                    didYouMean(rule.pattern, names) + allowed);
  }

  std::string shown(const Part& part) const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < part.own.size(); ++i)
      if (part.own[i]) names.push_back(scene_.objects[i].name);
    constexpr std::size_t kMost = 8;  // names in a line of the plan; ours
    const std::size_t count = names.size();
    if (count > kMost) {
      names.resize(kMost);
      names.push_back("and " + std::to_string(count - kMost) + " more");
    }
    return "fills " + (names.empty() ? "nothing" : joined(names, ", "));
  }

  const MethodConfig& config_;
  const scene::Scene& scene_;
  const methods::RunSettings& settings_;
  const std::vector<MethodEntry>& registry_;
  std::vector<SampleClass> classes_;  ///< by object id
  std::vector<bool> reflective_;      ///< by index of objects
  std::vector<Part> parts_;           ///< the entry's own method first
};

}  // namespace

std::unique_ptr<methods::Method> makeMethod(const MethodConfig& config, const scene::Scene& scene,
                                            const methods::RunSettings& settings,
                                            const std::vector<MethodEntry>& registry) {
  Assignment assignment(config, scene, settings, registry);
  assignment.requireSamples();
  assignment.byNames();
  assignment.unsupported();
  assignment.left();
  std::vector<Part> parts = assignment.take();
  if (parts.size() == 1 && !parts.front().takesUnsupported) return std::move(parts.front().method);
  return std::make_unique<MixedMethod>(std::move(parts));
}

}  // namespace catoptric::run

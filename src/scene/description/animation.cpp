// Motions of a described scene: keys of objects, and loops of morphs.
#include <algorithm>
#include <cmath>

#include "scene/description/composer.h"

namespace catoptric::scene {
namespace {

using config::Value;

constexpr int kLoopKeys = 16;  ///< cubic keys per cycle of a morph loop; error below 1e-4
constexpr int kMaxLoopKeys = 100'000;

const config::Schema* animationItem() {
  for (const config::Field& field : sceneSchema().fields) {
    if (field.name == "animation") return field.object;
  }
  return nullptr;
}

/// Values of a channel; smooth ones with Catmull-Rom tangents per second. Where the first and
/// the last key agree, the motion is a loop and its tangents go round.
void writeKeys(AnimationChannel& channel, const std::vector<std::vector<float>>& keys) {
  const std::size_t n = keys.size();
  const auto& times = channel.times;
  for (std::size_t i = 0; i < n; ++i) {
    if (channel.interpolation != Interpolation::CubicSpline) {
      channel.values.insert(channel.values.end(), keys[i].begin(), keys[i].end());
      continue;
    }
    std::vector<float> tangent(keys[i].size(), 0.0f);
    const bool loop = n > 2 && keys.front() == keys.back();
    const bool end = i == 0 || i + 1 == n;
    if (n > 1 && (!end || loop)) {
      const std::size_t before = end ? n - 2 : i - 1;
      const std::size_t after = end ? 1 : i + 1;
      const float span = end ? (times[n - 1] - times[n - 2]) + (times[1] - times[0])
                             : times[after] - times[before];
      for (std::size_t c = 0; c < tangent.size(); ++c) {
        tangent[c] = (keys[after][c] - keys[before][c]) / span;
      }
    }
    channel.values.insert(channel.values.end(), tangent.begin(), tangent.end());
    channel.values.insert(channel.values.end(), keys[i].begin(), keys[i].end());
    channel.values.insert(channel.values.end(), tangent.begin(), tangent.end());
  }
}

}  // namespace

void Composer::addLoop(const Value& object, int node, std::size_t targets) {
  if (targets == 0) return;
  struct Part {
    double cycle = 0.0;
    std::size_t targets = 1;
  };
  std::vector<Part> parts;
  double duration = 0.0;
  double shortest = 1e30;
  forEachMorph(object, [&](const Value& morph) {
    Part part;
    const MorphType type = morphOf(morph).type;
    part.targets = type == MorphType::Wave || type == MorphType::Flag ? 2 : 1;
    if (morph.has("cycle")) {
      part.cycle = morph.get("cycle").asNumber();
      duration = std::max(duration, config::valueOr(morph, morphSchema(), "duration").asNumber());
      shortest = std::min(shortest, part.cycle);
    }
    parts.push_back(part);
  });
  if (duration <= 0.0) return;
  const double keys = std::ceil(duration / shortest * kLoopKeys);
  if (keys > kMaxLoopKeys)
    object.get("morph").fail(
        "\"duration\" is too long for so short a \"cycle\": the animation would have too many "
        "keys");
  const int count = static_cast<int>(keys);
  AnimationChannel channel;
  channel.node = node;
  channel.target = Target::Weights;
  channel.interpolation = Interpolation::CubicSpline;
  for (int k = 0; k <= count; ++k) {
    const double t = duration * k / count;
    channel.times.push_back(static_cast<float>(t));
    std::vector<float> values;
    std::vector<float> tangents;
    for (const Part& part : parts) {
      const double w = part.cycle > 0.0 ? 2.0 * std::numbers::pi / part.cycle : 0.0;
      if (part.targets == 2) {
        values.push_back(static_cast<float>(part.cycle > 0.0 ? std::cos(w * t) : 0.0));
        tangents.push_back(static_cast<float>(-w * std::sin(w * t)));
        values.push_back(static_cast<float>(-std::sin(w * t)));
        tangents.push_back(static_cast<float>(-w * std::cos(w * t)));
      } else {
        values.push_back(static_cast<float>(std::sin(w * t)));
        tangents.push_back(static_cast<float>(w * std::cos(w * t)));
      }
    }
    channel.values.insert(channel.values.end(), tangents.begin(), tangents.end());
    channel.values.insert(channel.values.end(), values.begin(), values.end());
    channel.values.insert(channel.values.end(), tangents.begin(), tangents.end());
  }
  scene_.animation.push_back(std::move(channel));
}

void Composer::addAnimations(config::Errors& errors) {
  if (!root_.has("animation")) return;
  for (const Value& value : root_.get("animation").asArray()) {
    errors.collect([&] {
      for (const Handle& handle : handlesOf(value.get("object"))) addAnimation(value, handle);
    });
  }
}

void Composer::addAnimation(const Value& value, const Handle& handle) {
  const std::string name = value.get("channel").asString();
  AnimationChannel channel;
  channel.node = handle.node;
  std::size_t given = 3;
  channel.target = Target::Translation;
  if (name == "scale") channel.target = Target::Scale;
  if (name == "rotate" || name == "quaternion") channel.target = Target::Rotation;
  if (name == "quaternion") given = 4;
  if (name == "morph") {
    channel.target = Target::Weights;
    channel.node = handle.meshNode;
    given = handle.meshNode == kNone
                ? 0
                : scene_.nodes[static_cast<std::size_t>(handle.meshNode)].morphWeights.size();
    if (given == 0) value.get("object").fail("the object has no \"morph\"");
  }
  for (const AnimationChannel& other : scene_.animation) {
    if (other.node == channel.node && other.target == channel.target) {
      value.fail("the channel " + name + " of this object is animated already");
    }
  }

  std::vector<std::vector<float>> keys;
  Vec3 lastEuler(0.0f);
  for (const Value& key : value.get("keys").asArray()) {
    std::vector<float> k = key.asFloats(given + 1);
    if (!channel.times.empty() && k[0] <= channel.times.back()) {
      key.fail("times must increase from key to key");
    }
    channel.times.push_back(k[0]);
    k.erase(k.begin());
    if (channel.target == Target::Rotation) {
      Quat q;
      if (name == "rotate") {
        const Vec3 euler(k[0], k[1], k[2]);
        const Vec3 step = glm::abs(euler - lastEuler);
        if (!keys.empty() && std::max({step.x, step.y, step.z}) >= 180.0f) {
          key.fail(
              "an angle changes by 180 degrees or more from the key before; add keys between them");
        }
        lastEuler = euler;
        q = rotationOf(euler);
      } else {
        q = glm::length(Quat(k[3], k[0], k[1], k[2])) > 1e-6f
                ? glm::normalize(Quat(k[3], k[0], k[1], k[2]))
                : (key.fail("the quaternion is zero"), Quat());
      }
      // Neighbouring keys on the same side, so that cubic interpolation takes the short way.
      if (!keys.empty()) {
        const std::vector<float>& last = keys.back();
        if (q.x * last[0] + q.y * last[1] + q.z * last[2] + q.w * last[3] < 0.0f) q = -q;
      }
      k = {q.x, q.y, q.z, q.w};
    }
    keys.push_back(std::move(k));
  }
  const std::string interpolation =
      config::valueOr(value, *animationItem(), "interpolation").asString();
  channel.interpolation = interpolation == "step"     ? Interpolation::Step
                          : interpolation == "smooth" ? Interpolation::CubicSpline
                                                      : Interpolation::Linear;
  writeKeys(channel, keys);
  scene_.animation.push_back(std::move(channel));
}

}  // namespace catoptric::scene

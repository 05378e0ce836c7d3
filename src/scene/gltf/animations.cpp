// Animation channels of a glTF file.
#include <map>
#include <string>
#include <utility>

#include "scene/gltf/reader.h"

namespace catoptric::scene::gltf {
namespace {

/// One channel of the file, and where it stands.
struct Source {
  const tinygltf::AnimationChannel& channel;
  const tinygltf::AnimationSampler& sampler;
  const tinygltf::Node& node;
  std::string place;
  std::string samplerPlace;
};

/// What a channel moves. False for what this program does not know.
bool readTarget(const std::string& path, Target& target) {
  if (path == "translation") {
    target = Target::Translation;
  } else if (path == "rotation") {
    target = Target::Rotation;
  } else if (path == "scale") {
    target = Target::Scale;
  } else if (path == "weights") {
    target = Target::Weights;
  } else {
    return false;
  }
  return true;
}

void readTimes(Reader& reader, const Source& source, AnimationChannel& channel) {
  channel.times = reader.floats(source.sampler.input, 1, kFloat, source.samplerPlace + "/input");
  for (std::size_t i = 0; i < channel.times.size(); ++i) {
    if (channel.times[i] < 0.0f || (i > 0 && !(channel.times[i] > channel.times[i - 1]))) {
      reader.fail(source.samplerPlace + "/input",
                  "key " + std::to_string(i) + " at " + std::to_string(channel.times[i]) +
                      " s: times must be strictly increasing from 0");
    }
  }
}

/// Values in an output accessor for each key, in its elements.
std::size_t elementsPerKey(Reader& reader, const Source& source, const AnimationChannel& channel) {
  const std::size_t perKey = channel.interpolation == Interpolation::CubicSpline ? 3 : 1;
  if (channel.target != Target::Weights) return perKey;
  const std::size_t targets =
      source.node.mesh < 0
          ? 0
          : reader.model.meshes[size(source.node.mesh)].primitives.front().targets.size();
  if (targets == 0) {
    reader.fail(source.place + "/target", "node " + std::to_string(source.channel.target_node) +
                                              " has no morph targets to animate");
  }
  return perKey * targets;
}

void readValues(Reader& reader, const Source& source, AnimationChannel& channel) {
  const unsigned types = channel.target == Target::Rotation || channel.target == Target::Weights
                             ? kFloat | kByteNormalized | kUnsignedByteNormalized |
                                   kShortNormalized | kUnsignedShortNormalized
                             : static_cast<unsigned>(kFloat);
  const int components = channel.target == Target::Weights    ? 1
                         : channel.target == Target::Rotation ? 4
                                                              : 3;
  const int output = source.sampler.output;
  const std::size_t expected = channel.times.size() * elementsPerKey(reader, source, channel);
  if (reader.countOf(output) != expected) {
    reader.fail(source.samplerPlace + "/output",
                "has " + std::to_string(reader.countOf(output)) + " elements, " +
                    std::to_string(expected) + " are needed for " +
                    std::to_string(channel.times.size()) + " keys");
  }
  channel.values = reader.floats(output, components, types, source.samplerPlace + "/output");
  if (channel.target != Target::Rotation) return;

  // Keys must be unit; tangents need not.
  const std::size_t perKey = channel.interpolation == Interpolation::CubicSpline ? 3 : 1;
  for (std::size_t k = 0; k < channel.times.size(); ++k) {
    float* q = channel.values.data() + (k * perKey + (perKey == 3 ? 1 : 0)) * 4;
    const Quat unit = unitRotation(reader, q[0], q[1], q[2], q[3],
                                   source.samplerPlace + "/output (key " + std::to_string(k) + ")");
    q[0] = unit.x;
    q[1] = unit.y;
    q[2] = unit.z;
    q[3] = unit.w;
  }
}

}  // namespace

void readAnimations(Reader& reader, const NodeOrder& order) {
  Scene& scene = reader.scene;
  // (node, target) -> the animation that moves it
  std::map<std::pair<int, Target>, std::size_t> owners;
  for (std::size_t a = 0; a < reader.model.animations.size(); ++a) {
    const tinygltf::Animation& animation = reader.model.animations[a];
    for (std::size_t c = 0; c < animation.channels.size(); ++c) {
      const tinygltf::AnimationChannel& fileChannel = animation.channels[c];
      const std::string place = elementPlace("animations", a) + "/channels/" + std::to_string(c);
      AnimationChannel channel;
      if (!readTarget(fileChannel.target_path, channel.target)) {
        scene.notes.push_back(place + ": target path \"" + fileChannel.target_path.substr(0, 80) +
                              "\" is ignored");
        continue;
      }
      const Source source{
          fileChannel, animation.samplers[size(fileChannel.sampler)],
          reader.model.nodes[size(fileChannel.target_node)], place,
          elementPlace("animations", a) + "/samplers/" + std::to_string(fileChannel.sampler)};
      channel.node = order.sceneFromFile[size(fileChannel.target_node)];
      if (channel.target != Target::Weights && !source.node.matrix.empty()) {
        reader.fail(source.place + "/target/node",
                    "node " + std::to_string(fileChannel.target_node) +
                        " is animated, so it must not have a matrix");
      }
      const auto [owner, isNew] = owners.try_emplace({channel.node, channel.target}, a);
      if (!isNew) {
        if (owner->second == a) {
          reader.fail(source.place + "/target",
                      "node and path are animated by another channel already");
        }
        scene.notes.push_back(source.place + ": ignored, another animation moves the same node");
        continue;
      }
      readTimes(reader, source, channel);
      channel.interpolation = source.sampler.interpolation == "STEP" ? Interpolation::Step
                              : source.sampler.interpolation == "CUBICSPLINE"
                                  ? Interpolation::CubicSpline
                                  : Interpolation::Linear;
      readValues(reader, source, channel);
      scene.animation.push_back(std::move(channel));
    }
  }
  if (reader.model.animations.size() > 1) {
    scene.notes.push_back(std::to_string(reader.model.animations.size()) +
                          " animations are played together");
  }
}

}  // namespace catoptric::scene::gltf

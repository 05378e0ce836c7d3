// Plans of methods that refuse, and of frames that do not fit.
#include "run/folder/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.h"
#include "raster/gbuffer.h"

namespace catoptric::run {
namespace {

/// Refuses the second object and the scene as a whole.
class Refusing : public methods::Method {
 public:
  explicit Refusing(std::vector<methods::Unsupported> refused) : refused_(std::move(refused)) {}
  std::vector<methods::Unsupported> unsupported(const scene::Scene&) const override {
    return refused_;
  }
  methods::MethodPlan plan(const scene::Scene&, const methods::RunSettings&) const override {
    methods::MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = raster::kMaskSky;
    return plan;
  }
  void render(const methods::FrameInput&, methods::Services&, methods::FrameOutput&) override {}

 private:
  std::vector<methods::Unsupported> refused_;
};

scene::Scene twoBalls() {
  scene::Scene scene;
  scene.meshes.resize(1);
  scene.materials.resize(1);
  scene.objects.resize(2);
  scene.objects[0].name = "ball";
  scene.objects[1].name = "vase";
  for (scene::Object& object : scene.objects) object.mesh = object.material = 0;
  return scene;
}

Plan planned(std::vector<methods::Unsupported> refused, int size,
             const std::string& id = "refusing", bool masks = false,
             const scene::Scene& scene = twoBalls()) {
  RunConfig run;
  run.image.masks = masks;
  run.scene = "room.json";
  run.image.width = run.image.height = size;
  run.methods.push_back({"mine", id, {}, "{}"});
  std::vector<std::unique_ptr<methods::Method>> made;
  made.push_back(std::make_unique<Refusing>(std::move(refused)));
  return makePlan(run, scene, frame::EnvironmentLight(scene::Environment{}), 3, made);
}

TEST(Plan, RefusedObjectsAreNamed) {
  EXPECT_NO_THROW(planned({}, 8));
  try {
    planned({{2, "it is concave"}, {0, "two moments are needed"}}, 8);
    FAIL() << "no error";
  } catch (const UsageError& error) {
    EXPECT_EQ(error.code(), ExitCode::Usage);
    EXPECT_STREQ(error.what(),
                 "mine cannot render object 2 \"vase\" of room.json: it is concave; --set "
                 "methods.mine.unsupported=environment_map (or =traced) renders it by that "
                 "method\nmine cannot render the scene of room.json: two moments are needed");
  }
}

// Users do not take plastic for a reflector.
TEST(Plan, RefusedObjectsThatReflectLittleSaySo) {
  const auto message = [](float s) {
    scene::Scene scene = twoBalls();
    scene.materials[0].specularLevel = s;
    try {
      planned({{2, "it is concave"}}, 8, "refusing", false, scene);
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message(0.04f),
              testing::StartsWith("mine cannot render object 2 \"vase\" (a reflector, since "
                                  "plastic reflects 4 %) of room.json: it is concave; --set"));
  EXPECT_THAT(message(0.05f),
              testing::StartsWith("mine cannot render object 2 \"vase\" of room.json: "));
}

TEST(Plan, MasksAreNamed) {
  const std::vector<methods::PlanItem> items = planned({}, 8, "refusing", true).methods[0].items;
  const auto layers = std::ranges::find(items, "layers", &methods::PlanItem::name);
  ASSERT_NE(layers, items.end());
  EXPECT_EQ(layers->reason, "asked for: mask.reflective, mask.glossy, mask.sky");
}

TEST(Plan, ManyRefusedObjectsAreCounted) {
  try {
    planned(std::vector<methods::Unsupported>(5, {2, "it is concave"}), 8);
    FAIL() << "no error";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::EndsWith("\nmine cannot render 2 other objects either; "
                                                "`catoptric info` lists all reflectors"));
  }
}

// A method that takes no "unsupported" only refuses what its "reflectors" give to another one.
TEST(Plan, OptionsThatAMethodHasNotAreNotNamed) {
  try {
    planned({{2, "perturbation: it is concave"}}, 8, "traced");
    FAIL() << "no error";
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(),
                 "mine cannot render object 2 \"vase\" of room.json: perturbation: it is concave; "
                 "give another method for it in \"reflectors\" of methods.mine");
  }
}

TEST(Plan, CubeMapsOutOfProportionAreSaid) {
  const auto warning = [](const char* kind, std::uint64_t faceSize, int size) {
    Plan plan;
    plan.methods.resize(1);
    plan.methods[0].name = "mine";
    plan.methods[0].items = {{kind, "cube_map", "the scene from one point", 0},
                             {"resource", "cube map", "6 faces", 64 * faceSize * faceSize}};
    methods::RunSettings image;
    image.width = image.height = size;
    return cubeMapWarning(plan, image);
  };
  EXPECT_EQ(warning("pass", 256, 64), "");
  EXPECT_EQ(warning("pass", 1024, 1024), "");
  EXPECT_EQ(warning("precomputation", 4096, 1024), "");
  EXPECT_THAT(warning("pass", 4096, 512),
              testing::StartsWith("mine: the cube map (6 faces, 1.1 GB) has 96 times the frame's "
                                  "samples, and is drawn in each frame"));
  EXPECT_THAT(warning("precomputation", 4096, 256), testing::HasSubstr("before the first"));
}

TEST(Plan, BodiesThatNothingIsSeenThroughAreSaid) {
  const auto warning = [](int bounces, bool planar, float refraction) {
    scene::Scene scene = twoBalls();
    scene.materials[0].refraction = refraction;
    for (scene::Object& object : scene.objects) {
      object.reflector = 1;
      object.planar = planar;
    }
    Plan plan;
    plan.methods.resize(2);
    plan.methods[0].needs.bounces = bounces;
    plan.methods[0].name = "mine";
    return refractionWarning(plan, scene);
  };
  EXPECT_EQ(warning(1, false, 1.5f),
            "mine: nothing can be seen through \"ball\" and 1 other object: entering and leaving "
            "an object takes 2 "
            "bounces, but bounces is 1; set methods.mine.bounces=2 or more");
  EXPECT_EQ(warning(2, false, 1.5f), "");
  EXPECT_EQ(warning(0, false, 1.5f), "");  // no such option: it counts refraction_mirrored
  EXPECT_EQ(warning(1, true, 1.5f), "");
  EXPECT_EQ(warning(1, false, 0.0f), "");
}

TEST(Plan, SurprisesOfReflectionsAreSaid) {
  scene::Scene scene = twoBalls();
  scene::Material& material = scene.materials[0];
  Plan plan;
  plan.methods.resize(2);
  plan.methods[0].name = "mine";
  methods::RunSettings image;
  image.fresnelSchlick = true;
  const auto notes = [&] { return reflectionNotes(plan, scene, image); };
  EXPECT_TRUE(notes().empty());  // no method has reflectors to fill
  plan.methods[0].needs.gbuffer = true;
  EXPECT_THAT(notes(), testing::ElementsAre(
                           testing::AllOf(testing::StartsWith("nothing reflects: no object has"),
                                          testing::HasSubstr("(mine)"))));
  material.lobe = scene::LobeModel::Ggx;
  EXPECT_THAT(notes(), testing::ElementsAre(testing::StartsWith(
                           "nothing reflects: 2 objects of glTF's dielectrics reflect less than "
                           "5 %")));
  material.unlit = true;
  EXPECT_THAT(notes(), testing::ElementsAre(testing::StartsWith("nothing reflects: no object")));
  for (scene::Object& object : scene.objects) object.reflector = 1;
  EXPECT_THAT(notes(), testing::ElementsAre(testing::StartsWith("image.fresnel changes nothing")));
  material.lobe = scene::LobeModel::Phong;
  material.specularLevel = 0.5f;
  EXPECT_TRUE(notes().empty());
  plan.methods[0].needs.bounces = 1;
  EXPECT_THAT(notes(), testing::ElementsAre(testing::HasSubstr("bounces is 1 (mine)")));
  plan.methods[0].needs.bounces = 2;
  EXPECT_TRUE(notes().empty());
}

TEST(Plan, BytesAreThoseOfTheFrame) {
  // 2 x 2 samples of 60 bytes; 16 bytes of the composite and of each of 3 frames under way; 12 of
  // each of 2 files that are encoded, and 4 of its preview
  const std::uint64_t pixel = planned({}, 2000).bytesOf(planned({}, 2000).methods[0]) -
                              planned({}, 1000).bytesOf(planned({}, 1000).methods[0]);
  EXPECT_EQ(pixel, 3'000'000u * (4 * 60 + 16 + 3 * 16 + 2 * (12 + 4)));
}

}  // namespace
}  // namespace catoptric::run

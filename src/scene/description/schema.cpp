// Tables of the scene description.
#include <map>

#include "config/fields.h"
#include "scene/description/description.h"
#include "scene/procedural/procedural.h"

namespace catoptric::scene {
namespace {

using config::Field;
using config::FieldType;
using config::Schema;
using config::fields::any, config::fields::arrayOf, config::fields::boolean, config::fields::choice;
using config::fields::integer, config::fields::number, config::fields::numbers,
    config::fields::object;
using config::fields::required, config::fields::text, config::fields::vec3;

constexpr double kTiny = 1e-5;      // metres; nothing sensible is smaller
constexpr double kHuge = 1e6;       // metres
constexpr double kSegments = 4096;  // of one direction of one shape

const std::vector<Field>& commonFields() {
  static const std::vector<Field> fields{
      text("name", "The object's name, by which messages, animations and lights refer to it."),
      any("comment", "Any text; not read."),
      text("asset", "A .gltf or .glb file that is placed in the scene."),
      boolean("lights", "Whether the asset's lights come along.", "true"),
      boolean("animated", "Whether the asset's animations come along.", "true"),
      arrayOf("nodes",
              "Takes only the asset's nodes whose names match one of these patterns, with what is "
              "below them.",
              FieldType::String),
      vec3("translate", "Where the object is, in metres, in the parent's space.", "[0, 0, 0]"),
      vec3("rotate",
           "Degrees about x, y and z; the object is turned about z first, then about x, then about "
           "y.",
           "[0, 0, 0]"),
      numbers("quaternion", "A rotation as x, y, z, w, in place of rotate."),
      any("scale", "One factor for all axes, or one for each of x, y and z.", "1"),
      any("fit",
          "The size that the bounding box gets: metres along each axis, or null where the "
          "proportion is kept."),
      choice("anchor", "The point of the object that comes to translate.", "\"origin\"",
             {"origin", "center", "bottom", "top", "back"}),
      any("material", "The name of a material, or a material itself."),
      object("materials",
             "Replaces the asset's materials: a pattern of their names, and the name of a "
             "material or a material itself."),
      any("reflective", "Whether the object reflects: false, true, or its {s, g} or {s, n}."),
      choice("uv",
             "How texture coordinates lie on a shape: 0 to 1 over each face, or 1 to a metre.",
             "\"unit\"", {"unit", "metres"}),
      any("repeat", "Makes copies of the object: {count, step, rotate_step, around}."),
      arrayOf("children", "Objects that stand in this object's space.", FieldType::Object),
      any("morph", "Makes the shape deform: one or several deformations, as in the table morph."),
      boolean("visible", "With false the object is left out, and its children with it.", "true"),
  };
  return fields;
}

Field cell() {
  return number("cell", "The longest edge of a grid cell in metres, in place of segments.", "",
                1e-3, kHuge);
}

Field radius(const char* standard) {
  return number("radius", "The radius in metres.", standard, kTiny, kHuge);
}

Field segments(const char* help, const char* standard) {
  return numbers("segments", help, standard, 1.0, kSegments);
}

/// Parameters of the shape "implicit".
std::vector<Field> implicitFields() {
  return {
      required(choice("surface", "Which surface it is.", "",
                      {"plane", "sphere", "ellipsoid", "cylinder", "cone", "torus", "quadric",
                       "superquadric", "metaballs", "revolution", "vase", "gyroid", "heart",
                       "genus2", "blobby_cube", "formula"})),
      text("formula",
           "Of formula: a function of x, y and z in metres; the surface is where it is 0."),
      object("parameters", "Of formula: names for numbers in it."),
      any("bounds",
          "Where the surface ends: a half size in metres, 3 of them, or the least x, y, z and the "
          "largest x, y, z. A formula, a quadric and a plane need it."),
      radius("0.5"),
      number("tube", "Of a torus: the radius of its tube in metres.", "0.2", kTiny, kHuge),
      number("height", "Of a cylinder and a cone: the height in metres.", "1", kTiny, kHuge),
      numbers("radii", "Of an ellipsoid and a superquadric: the radii along x, y and z in metres.",
              "", kTiny, kHuge),
      numbers("exponents", "Of a superquadric: the exponents around y and along y.", "[0.5, 0.5]",
              0.1, 4.0),
      vec3("normal", "Of a plane: the direction that points out.", "[0, 1, 0]"),
      number("offset", "Of a plane: how far it lies along its normal, in metres.", "0", -kHuge,
             kHuge),
      numbers(
          "coefficients",
          "Of a revolution: r(y) = c0 + c1 y + ... Of a quadric: the coefficients of xx, yy, zz, "
          "xy, xz, yz, x, y, z and 1."),
      numbers("range", "Of a revolution: from which y to which, in metres.", "[0, 1]"),
      arrayOf("balls", "Of metaballs: x, y, z and the radius of each ball in metres.",
              FieldType::Numbers, 0.0),
      number("sharpness", "Of metaballs: those of a high sharpness melt together less.", "2", 0.05,
             100.0),
      number("period", "Of a gyroid: the length after which it repeats, in metres.", "1", 0.01,
             kHuge),
      number("thickness", "Of a gyroid: the thickness of its wall in metres.", "0.2", 1e-3, kHuge),
      numbers(
          "segments",
          "Around y and along y: divides a sphere, an ellipsoid, a cylinder, a cone, a torus, a "
          "revolution or a vase regularly.",
          "", 2.0, kSegments),
      integer("resolution",
              "The number of cells along the longest side, where segments are not given.", "48", 4,
              512)};
}

/// Own parameters of each shape.
std::vector<Field> revolutionFields() {
  return {
      arrayOf("profile", "Points [r, y] in metres, from bottom to top.", FieldType::Numbers),
      choice("curve", "The curve through the profile's points.", "\"catmull_rom\"",
             {"polyline", "catmull_rom", "bezier", "polynomial"}),
      numbers("coefficients", "Of a polynomial: r(y) = c0 + c1 y + ..."),
      numbers("range", "Of a polynomial: from which y to which, in metres.", "[0, 1]"),
      number("thickness",
             "The thickness in metres; above 0 the shape is a vessel with an inner wall and a rim.",
             "0", 0.0, kHuge),
      segments("How many parts the shape has around, and along its profile.", "[64, 48]"),
      number("smooth_angle", "Degrees; bends that are sharper keep an edge.", "40", 0.0, 180.0),
      boolean("caps", "Whether ends that are off the axis are closed.", "true")};
}

const std::vector<std::pair<std::string, std::vector<Field>>>& shapeFields() {
  const auto size3 =
      numbers("size", "Width, height and depth in metres.", "[1, 1, 1]", kTiny, kHuge);
  static const std::vector<std::pair<std::string, std::vector<Field>>> shapes{
      {"plane",
       {numbers("size", "The size in x and z in metres.", "[1, 1]", kTiny, kHuge),
        segments("How many parts the shape has in x and z.", "[1, 1]"), cell()}},
      {"box",
       {size3,
        segments("How many parts the shape has in x, y and z.", "[1, 1, 1]"),
        cell(),
        boolean("inward", "Whether the faces point inwards, as those of a room do.", "false"),
        {.name = "faces",
         .type = FieldType::Array,
         .help = "Which faces are made; without it all are.",
         .allowed = {"+x", "-x", "+y", "-y", "+z", "-z"},
         .items = FieldType::String}}},
      {"rounded_box",
       {size3, number("radius", "The radius of the edges in metres.", "0.05", kTiny, kHuge),
        integer("rounding", "How many segments a quarter of a round has.", "4", 1, 64)}},
      {"panel",
       {numbers("size", "Width and height in metres.", "[1, 1]", kTiny, kHuge),
        number("thickness", "The thickness in metres; 0 makes a sheet.", "0", 0.0, kHuge),
        arrayOf("openings",
                "Openings: x and y of the lower left corner (x from the middle), width and height.",
                FieldType::Numbers, 0.0),
        cell()}},
      {"sphere",
       {radius("0.5"),
        segments("How many parts the shape has around, and from pole to pole.", "[48, 24]"),
        integer("icosphere", "How often an icosahedron is divided, in place of segments.", "", 0,
                8)}},
      {"torus",
       {radius("0.5"), number("tube", "The radius of the tube in metres.", "0.2", kTiny, kHuge),
        segments("How many parts the shape has around, and around the tube.", "[64, 32]")}},
      {"disk",
       {radius("0.5"), number("inner", "The radius of a hole in metres.", "0", 0.0, kHuge),
        segments("How many parts the shape has around, and how many rings.", "[48, 1]"), cell()}},
      {"cylinder",
       {radius("0.5"),
        number("top",
               "The radius at the top in metres; without it that at the foot; 0 makes a cone.", "",
               0.0, kHuge),
        number("height", "The height in metres.", "1", kTiny, kHuge),
        segments("How many parts the shape has around, and upwards.", "[48, 1]"),
        boolean("caps", "Whether it is closed below and above.", "true")}},
      {"teapot",
       {number("height", "The height in metres.", "0.5", kTiny, kHuge),
        integer("segments", "How many parts an edge of a patch has.", "10", 1, 256),
        boolean("lid", "Whether the teapot has its lid.", "true")}},
      {"revolution", revolutionFields()},
      {"tube",
       {required(arrayOf("points", "The points that the bar runs through, in metres.",
                         FieldType::Vec3, 2.0)),
        any("radius", "The radius in metres: one, or one for each point.", "0.02"),
        choice("curve", "The curve through the points.", "\"catmull_rom\"",
               {"catmull_rom", "polyline"}),
        segments("How many parts the bar has around, and along each span.", "[16, 8]"),
        boolean("closed", "Whether the bar is a ring.", "false"),
        boolean("caps", "Whether the ends are rounded.", "true")}},
      {"prism",
       {required(arrayOf("outline", "Points [x, z] in metres of a simple polygon.",
                         FieldType::Numbers, 3.0)),
        number("height", "The height in metres.", "1", kTiny, kHuge),
        number("bevel", "The width of the bevel in metres.", "0", 0.0, kHuge)}},
      {"polygons",
       {required(arrayOf("vertices", "The vertices in metres.", FieldType::Vec3, 3.0)),
        required(arrayOf(
            "faces", "The numbers of each face's vertices, counter-clockwise as seen from outside.",
            FieldType::Numbers, 1.0)),
        boolean("smooth", "Whether faces share their normals at vertices.", "false")}},
      {"implicit", implicitFields()},
  };
  return shapes;
}

Schema withCommon(const std::string& name, const std::vector<Field>& own) {
  Schema schema{name, "An object of a scene.", {}};
  schema.fields = commonFields();
  if (!own.empty() || name != "object")
    schema.fields.push_back(text("shape", "The built-in shape that the object is."));
  schema.fields.insert(schema.fields.end(), own.begin(), own.end());
  return schema;
}

}  // namespace

const std::vector<std::string>& shapeNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [name, fields] : shapeFields()) all.push_back(name);
    return all;
  }();
  return names;
}

const Schema& objectSchema(const std::string& shape) {
  static const std::map<std::string, Schema> schemas = [] {
    std::map<std::string, Schema> all;
    all.emplace("", withCommon("object", {}));
    for (const auto& [name, fields] : shapeFields()) {
      all.emplace(name, withCommon("object (" + name + ")", fields));
    }
    return all;
  }();
  return schemas.at(shape);
}

const Schema& materialSchema() {
  static const Schema schema{
      "material",
      "A material: by s and g (or n), or by glTF's metallic and roughness.",
      {
          any("comment", "Any text; not read."),
          any("base_color", "The albedo: [r, g, b] in linear values, or \"#rrggbb\".", "[1, 1, 1]"),
          any("texture", "A file, or {\"procedural\": ...}, that multiplies the albedo."),
          any("normal_map",
              "A file, {\"procedural\": ..., \"strength\"}, or \"match\": that of the texture."),
          number("normal_scale", "Multiplies the slopes of the normal map.", "1", -100.0, 100.0),
          text("metallic_roughness_map",
               "A file that has the roughness in green and the metallic share in blue."),
          any("uv_scale",
              "Multiplies the texture coordinates: a number, or one for each of u and v.", "1"),
          numbers("uv_offset", "Is added to the texture coordinates: 2 numbers.", "[0, 0]"),
          number("uv_rotate", "Turns the texture by so many degrees.", "0"),
          choice("filter", "How textures are filtered.", "\"linear\"", {"linear", "nearest"}),
          choice("wrap", "What textures show outside of 0 to 1.", "\"repeat\"",
                 {"repeat", "mirror", "clamp"}),
          number("s", "The specular level, from 0 (diffuse) to 1 (a mirror).", "", 0.0, 1.0),
          number("g", "The roughness of the Phong lobe, from 0 (sharp) to 1.", "", 0.0, 1.0),
          number("n", "The Phong exponent, instead of g.", "", 0.0, 1e9),
          any("tint", "The colour of the reflection.", "[1, 1, 1]"),
          number("refraction",
                 "The body's index of refraction: the part s is refracted in place of mirrored.",
                 "", 1.0, 10.0),
          number("metallic", "How metallic the material is, from 0 to 1.", "0", 0.0, 1.0),
          number("roughness", "glTF's roughness, from 0 (sharp) to 1; with s another name of g.",
                 "1", 0.0, 1.0),
          number("ior",
                 "The index of refraction, from which the reflection of a dielectric follows.",
                 "1.5", 1.0, 10.0),
          number("specular", "Multiplies the reflection of a dielectric.", "1", 0.0, 1.0),
          choice("lobe",
                 "The lobe: by default Phong's for s, g and n, GGX' for metallic and roughness.",
                 "", {"phong", "ggx"}),
          any("emissive", "The radiance that the material gives.", "[0, 0, 0]"),
          number("emissive_strength", "Multiplies emissive.", "1", 0.0, 1e30),
          any("emissive_texture", "A file, or {\"procedural\": ...}, that multiplies emissive."),
          number("alpha_cutoff", "Texels with less alpha than this are cut out.", "", 0.0, 1.0),
          boolean("unlit", "Whether the material shows its albedo as it is, without light.",
                  "false"),
          boolean("keep",
                  "Whether only what is named here is changed of the material that is replaced.",
                  "false"),
      }};
  return schema;
}

const Schema& lightSchema() {
  static const Schema schema{
      "light",
      "A light.",
      {
          text("name", "The light's name, for messages."),
          any("comment", "Any text; not read."),
          required(
              choice("type", "The kind of light.", "", {"point", "spot", "directional", "sphere"})),
          vec3("position", "Where the light is, in metres.", "[0, 0, 0]"),
          vec3("direction", "The direction into which it shines.", "[0, -1, 0]"),
          vec3("target", "The point to which it shines, in metres, in place of direction."),
          any("color", "The colour: [r, g, b] in linear values, or \"#rrggbb\".", "[1, 1, 1]"),
          number("intensity", "The intensity in W/sr; of a directional light W/m^2.", "1", 0.0,
                 1e30),
          number("range", "How far the light reaches in metres; 0 is without limit.", "0", 0.0,
                 kHuge),
          number("inner_cone", "The half angle of the cone of full light, in degrees.", "0", 0.0,
                 90.0),
          number("outer_cone",
                 "The half angle of the cone outside of which there is no light, in degrees.", "45",
                 0.0, 90.0),
          number("radius", "The radius in metres, which makes baked shadows soft.", "0", 0.0,
                 kHuge),
          boolean("baked", "Whether the light acts through the bake, with shadows.", "false"),
          text("object", "The object in whose space position and direction are."),
      }};
  return schema;
}

const Schema& morphSchema() {
  static const Schema schema{
      "morph",
      "A deformation of a shape.",
      {
          required(choice("type", "The kind of deformation.", "",
                          {"wave", "flag", "bulge", "twist", "stretch"})),
          number(
              "amplitude",
              "How far it goes, in metres; of a twist turns, of a stretch a share of the length.",
              "0.1", -kHuge, kHuge),
          number("waves", "How many waves there are along the shape.", "2", 0.0, 1000.0),
          vec3("axis", "The direction of the displacement.", "[0, 1, 0]"),
          number("cycle",
                 "Seconds of an endless loop; without it the channel morph is to be animated.", "",
                 0.01, 1e6),
          number("duration", "For how many seconds the loop goes on.", "10", 0.01, 1e6),
      }};
  return schema;
}

namespace {

const Schema& environmentSchema() {
  static const Schema schema{
      "environment",
      "What lights the scene from infinitely far away.",
      {
          required(
              choice("type", "The kind of environment.", "", {"constant", "gradient", "file"})),
          any("color", "Of a constant environment: its radiance."),
          any("zenith", "Of a gradient: the radiance above."),
          any("horizon", "Of a gradient: the radiance at the horizon."),
          any("ground", "Of a gradient: the radiance below."),
          text("file", "An image by latitude and longitude, EXR or HDR."),
          number("scale", "Multiplies all radiances.", "1", 0.0, 1e30),
          number("rotate", "Of an image: degrees by which it is turned about +y.", "0"),
      }};
  return schema;
}

const Schema& bakeSchema() {
  static const Schema schema{
      "bake",
      "What is computed for each vertex when the scene is loaded.",
      {
          choice("mode", "What is baked.", "\"none\"", {"none", "ambient_occlusion", "full"}),
          integer("rays", "How many rays each vertex sends into its hemisphere.", "256", 1, 65536),
          integer("bounces", "Of full: how often light is gathered that surfaces give one another.",
                  "2", 0, 16),
          number(
              "distance",
              "How far away surfaces still shade, in metres; 0 is a tenth of the scene's diameter.",
              "0", 0.0, kHuge),
      }};
  return schema;
}

const Schema& animationSchema() {
  static const Schema schema{
      "animation",
      "The keys of one channel of one object.",
      {
          any("comment", "Any text; not read."),
          required(text("object", "The object's name.")),
          required(choice("channel", "What of the object is animated.", "",
                          {"translate", "rotate", "scale", "quaternion", "morph"})),
          choice("interpolation", "What happens between the keys.", "\"linear\"",
                 {"linear", "step", "smooth"}),
          required(
              arrayOf("keys", "The keys, each [seconds, values...].", FieldType::Numbers, 1.0)),
      }};
  return schema;
}

const Schema& cameraSchema() {
  static const Schema schema{
      "camera",
      "A fixed camera.",
      {
          text("name", "The camera's name, for camera paths."),
          required(vec3("position", "Where the camera is, in metres.")),
          required(vec3("target", "The point at which it looks, in metres.")),
          number("fov", "The vertical field of view in degrees.", "60", 0.001, 179.9),
      }};
  return schema;
}

}  // namespace

const Schema& sceneSchema() {
  // Objects are checked one by one with their shape's own table.
  static const Schema anyObject = [] {
    Schema schema = withCommon("object", {});
    schema.fields.push_back(text("shape", "The built-in shape that the object is."));
    schema.open = true;
    return schema;
  }();
  static const Schema schema{
      "scene",
      "A scene description.",
      {
          text("$schema", "For editors; not read."),
          text("name", "The scene's name, for reports."),
          any("comment", "Any text; not read."),
          required(arrayOf("objects", "The objects of the scene.", anyObject)),
          object("materials", "Materials by their names."),
          arrayOf("lights", "The lights.", lightSchema()),
          object("environment",
                 "What lights the scene from far away; without it the surroundings are black.",
                 &environmentSchema()),
          any("ambient", "A radiance that comes from everywhere: [r, g, b] or \"#rrggbb\".",
              "[0, 0, 0]"),
          boolean("highlights", "Whether lights that are not baked show in glossy surfaces.",
                  "false"),
          choice("dielectrics",
                 "Whether materials with a GGX lobe reflect even if their s is below 0.05.",
                 "\"off\"", {"on", "off"}),
          object("bake", "What is baked.", &bakeSchema()),
          arrayOf("animation", "How objects move.", animationSchema()),
          arrayOf("cameras", "Fixed cameras.", cameraSchema()),
      }};
  return schema;
}

}  // namespace catoptric::scene

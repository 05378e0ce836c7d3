// The command tables, as a program.
#include <gmock/gmock.h>

#include "app/test_program.h"
#include "config/json.h"

namespace catoptric::app {
namespace {

using testing::HasSubstr;

class Tables : public Study {};

TEST_F(Tables, RenderWhatTheAskedOnesNeed) {
  std::ofstream(folder / "o.suite.json") << R"json({"title": "O", "runs": {
  "one": {"config": "run.json", "frames": {"smoke": "1"}, "against": "truth", "times": false},
  "two": {"config": "run.json", "frames": {"smoke": "2"}, "against": "truth", "times": false}},
  "tables": [
    {"title": "A", "columns": ["a"], "rows": [["error(one.reference, L1_8bit)"]]},
    {"title": "B", "columns": ["b", "c"], "rows": [["error(two.reference, L1_8bit)", "slope(1, s)"]]}],
  "figures": [{"title": "F", "x": "x", "y": "y", "values": [1, 2], "series": {
    "s": ["error(two.reference, L1_8bit)", "error(two.reference, rmse)"]}}],
  "checks": [{"value": "error(one.reference, L1_8bit)", "from": 0, "to": 255}]})json";
  const std::string command = "tables o.suite.json --effort smoke --out t --progress none ";
  const Result second = run(command + "--only 2");
  EXPECT_EQ(second.exitCode, 0) << second.err;
  EXPECT_THAT(second.err, HasSubstr("two: 2 frames rendered"));
  EXPECT_THAT(second.err, testing::Not(HasSubstr("one: ")));
  EXPECT_THAT(second.out, testing::Not(HasSubstr("A\n")));
  EXPECT_THAT(run(command).err, HasSubstr("one: 2 frames rendered"));
  EXPECT_THAT(run(command + "--only 3").err, HasSubstr("--only 3: the suite has 2 tables"));
  EXPECT_THAT(run(command + "--only 1 --check").err, HasSubstr("--only cannot be combined"));
}

TEST_F(Tables, TextAloneLoadsNoSceneThatWasNeverMeasured) {
  std::ofstream(folder / "b.suite.json") << R"json({"title": "B", "runs": {
  "r": {"config": "run.json", "against": "truth"}},
  "tables": [{"title": "T", "columns": ["a"], "rows": [["ms(r.reference)"]]}]})json";
  fs::remove(folder / "scene.json");
  const Result result = run("tables b.suite.json --text-only --out t --progress none");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_THAT(result.err, HasSubstr("--text-only: the run r has not been measured"));
}

TEST_F(Tables, ASlopeOfItselfIsRefused) {
  for (const auto& [cells, text] :
       {std::pair(R"-(["slope(1, a)"])-", "has a slope among its values"),
        std::pair("[1, 2]", "has 2 values, its figure 1")}) {
    std::ofstream(folder / "b.suite.json")
        << R"json({"title": "B", "runs": {"r": {"config": "run.json", "against": "truth"}},
  "figures": [{"title": "F", "x": "x", "y": "y", "values": [1], "series": {"a": )json"
        << cells << R"json(}}],
  "tables": [{"title": "T", "columns": ["a"], "rows": [["slope(1, a)"]]}]})json";
    const Result result = run("tables b.suite.json --effort smoke --out t --progress none");
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_THAT(result.err, HasSubstr(text));
  }
}

TEST_F(Tables, AChangedSettingRendersItsCellAlone) {
  const auto write = [&](int samples, const char* checks) {
    std::ofstream(folder / "many.json") << R"({
  "scene": "scene.json", "path": "path.json", "frames": "1", "image": {"width": 32, "height": 24},
  "methods": [{"method": "reference", "max_standard_error": 0, "name": "a", "samples": 1, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "b", "samples": )"
                                        << samples << R"(, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 4, "rays": 1}]})";
    std::ofstream(folder / "b.suite.json") << R"json({"title": "B", "runs": {
  "times": {"config": "many.json", "against": "truth"},
  "errors": {"config": "many.json", "against": "truth", "times": false}},
  "efforts": {"smoke": {"image.height": 12}}, "checks": )json"
                                           << checks << R"json(,
  "tables": [{"title": "T", "columns": ["a", "b", "ratio"], "rows": [
    ["error(errors.a, L1_8bit)", "error(errors.b, L1_8bit)", "ratio(times.a, times.b)"]]}]})json";
  };
  const std::string command = "tables b.suite.json --effort smoke --out t --progress none ";
  write(2, "[]");
  const Result first = run(command);
  ASSERT_EQ(first.exitCode, 0) << first.err;
  const Result nowhere = run("tables b.suite.json --effort smoke --out /proc/nope");
  EXPECT_EQ(nowhere.exitCode, 5) << nowhere.err;
  EXPECT_THAT(nowhere.err, HasSubstr("/proc/nope: cannot be created"));
  EXPECT_THAT(first.err, HasSubstr("times: 9 frames rendered"));   // three, first, warm and timed
  EXPECT_THAT(first.err, HasSubstr("errors: 3 frames rendered"));  // three
  write(3, R"json([{"value": "error(errors.b, L1_8bit)", "from": 100, "to": 101}])json");
  const Result second = run(command + "--check");
  EXPECT_EQ(second.exitCode, 7) << second.err;
  EXPECT_THAT(second.err, HasSubstr("expected 100 to 101"));
  EXPECT_THAT(second.err, HasSubstr("times: 6 frames rendered"));  // b, beside the truth
  EXPECT_THAT(second.err, HasSubstr("errors: 1 frames rendered"));
  EXPECT_THAT(textOf(folder / "t/tables.md"), HasSubstr("too few rounds"));
}

TEST_F(Tables, ValuesOfAFileAreMeasuredAgainWhereTheirSettingsChanged) {
  const auto write = [&](int samples, const std::string& title) {
    std::ofstream(folder / "v.json") << R"({
  "scene": "scene.json", "path": "path.json", "frames": "1-2", "image": {"width": 32, "height": 24},
  "methods": [{"method": "reference", "max_standard_error": 0, "name": "a", "samples": 1, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "b", "samples": )"
                                     << samples << R"(, "rays": 1},
              {"method": "reference", "max_standard_error": 0, "name": "truth", "samples": 4, "rays": 1}]})";
    std::ofstream(folder / "v.suite.json")
        << R"json({"title": ")json" << title << R"json(", "runs": {
  "errors": {"config": "v.json", "against": "truth", "times": false},
  "more": {"config": "v.json", "against": "truth", "times": false}},
  "tables": [{"title": "T", "columns": ["a", "b", "rays"], "rows": [
    ["spread(error, errors.a, L1_8bit)", "error(errors.b, L1_8bit)", "spread(mean, more.a, rays)"]]}]})json";
  };
  const auto command = [&](const std::string& out) {
    return "tables v.suite.json --values v.values.json --into v.md --progress none --out " + out +
           " ";
  };
  std::ofstream(folder / "v.md") << "Old.\n\n<!-- table 1 -->\n<!-- end -->\n";
  write(2, "V");
  EXPECT_EQ(run(command("one") + "--text-only").exitCode, 2);  // no values yet
  ASSERT_EQ(run(command("one")).exitCode, 0);
  const std::string page = textOf(folder / "v.md");
  const std::string values = textOf(folder / "v.values.json");
  EXPECT_THAT(
      page, testing::ContainsRegex("\\| [0-9.]+ / [0-9.]+ \\| [0-9.]+ \\| [0-9.]+ / [0-9.]+ \\|"));
  // In another folder, where nothing was rendered, another title and text: the file is enough.
  write(2, "Other");
  std::ofstream(folder / "v.md") << "New.\n\n<!-- table 1 -->\n<!-- end -->\n";
  const Result again = run(command("two") + "--text-only");
  ASSERT_EQ(again.exitCode, 0) << again.err;
  EXPECT_EQ(textOf(folder / "v.md"), "New." + page.substr(4));
  EXPECT_THAT(textOf(folder / "two/tables.md"), HasSubstr("Other"));
  // One method's setting: its cells alone, beside the reference.
  write(3, "Other");
  const Result stale = run(command("three") + "--text-only");
  EXPECT_EQ(stale.exitCode, 2);
  EXPECT_THAT(stale.err, HasSubstr("the run errors"));
  const Result third = run(command("three"));
  ASSERT_EQ(third.exitCode, 0) << third.err;
  EXPECT_THAT(third.err, HasSubstr("errors: 4 frames rendered"));  // two of b, two of the truth
  EXPECT_THAT(third.err, testing::Not(HasSubstr("more: ")));
  const std::string changed = textOf(folder / "v.values.json");
  EXPECT_NE(changed, values);
  const auto line = [](const std::string& text, const std::string& cell) {
    const std::size_t at = text.find("\"" + cell);
    return text.substr(at, text.find('\n', at) - at);
  };
  for (const char* cell : {"spread(error, errors.a", "spread(mean, more.a"})
    EXPECT_EQ(line(changed, cell), line(values, cell));
  EXPECT_NE(line(changed, "error(errors.b"), line(values, "error(errors.b"));
}

TEST_F(Tables, SuitesPatchScenesAndDrawPictures) {
  fs::create_directory(folder / "beside");
  const auto write = [&](const std::string& label, const std::string& patch) {
    std::ofstream(folder / "p.suite.json")
        << R"json({"title": "P", "runs": {
  "plain": {"config": "run.json", "against": "truth", "times": false},
  "patched": {"config": "run.json", "against": "truth", "times": false, "scene_patch": )json"
        << patch << R"json(, "path_patch": [{"op": "add", "path": "/fov", "value": 30}]}},
  "tables": [],
  "figures": [{"title": "F", "file": "f.svg", "x": "run", "y": "L1", "values": [1], "series":
               {"a": ["error(plain.reference, L1_8bit)"]}}],
  "pictures": [{"file": "p.svg", "frame": 2, "against": "truth", "rows": [
    [{"of": "plain.reference", "zoom": 8, "label": ")json"
        << label << R"json("}, {"of": "patched.truth", "crop": [1, 2, 3, 4], "zoom": 5}],
    [{"of": "plain.reference", "difference": 9}]]}]})json";
  };
  const std::string command =
      "tables p.suite.json --pictures pictures --values p.values.json --progress none --out ";
  const std::string patch = R"([{"op": "add", "path": "/name", "value": "other"}])";
  write("L1 {error}, {mean(plain.reference, rays)} rays", patch);
  const Result first = run(command + "one");
  ASSERT_EQ(first.exitCode, 0) << first.err;
  const std::string picture = textOf(folder / "pictures/p.svg");
  EXPECT_THAT(picture, testing::ContainsRegex(">L1 [0-9.]+, [0-9.]+ rays</text>"));
  EXPECT_THAT(picture, HasSubstr("width=\"15\" height=\"20\""));
  EXPECT_THAT(textOf(folder / "pictures/f.svg"), HasSubstr("<svg"));
  EXPECT_THAT(textOf(folder / "one/scenes/patched.scene.json"), HasSubstr("\"other\""));
  EXPECT_THAT(textOf(folder / "one/scenes/patched.path.json"), HasSubstr("30"));
  EXPECT_TRUE(fs::exists(folder / "one/scenes/beside"));
  // Nothing has changed: nothing is rendered or drawn
  const Result second = run(command + "two");
  ASSERT_EQ(second.exitCode, 0) << second.err;
  EXPECT_THAT(second.err, testing::Not(HasSubstr("picture: ")));
  EXPECT_THAT(second.err, testing::Not(HasSubstr("rendered")));
  write("{error}", patch);
  EXPECT_THAT(run(command + "two").err, HasSubstr("picture: pictures/p.svg"));
  write("{error}", R"([{"op": "remove", "path": "/gone"}])");
  const Result wrong = run(command + "two");
  EXPECT_EQ(wrong.exitCode, 2) << wrong.err;
  EXPECT_THAT(wrong.err, HasSubstr("/runs/patched/scene_patch: this patch cannot be applied to "));
  EXPECT_THAT(wrong.err, HasSubstr("gone"));
}

TEST_F(Tables, AreMadeAgainWithoutRendering) {
  const auto write = [&](const std::string& title, const std::string& samples) {
    std::ofstream(folder / "a.suite.json")
        << R"json({"title": "A", "runs": {
  "one": {"config": "run.json", "settings": {"methods.reference.samples": )json"
        << samples << R"json(}, "frames": {"smoke": "1"}, "against": "truth"},
  "two": {"config": "run.json", "frames": {"smoke": "2"}, "against": "truth"}},
  "tables": [{"title": ")json"
        << title << R"json(", "columns": ["run", "ms", "L1_8bit"], "rows": [
    ["one", "ms(one.reference)", "error(one.reference, L1_8bit)"],
    ["two", "ms(two.reference)", "18 (25, 13)"]]}],
  "figures": [{"title": "F", "x": "run", "y": "ms", "values": [1, 2],
               "series": {"reference": ["ms(one.reference)", "ms(two.reference)"]}}]})json";
  };
  const std::string command = "tables a.suite.json --effort smoke --out t --progress none ";
  write("Before", "1");
  const Result first = run(command + "--format md,csv,json,tex,html");
  ASSERT_EQ(first.exitCode, 0) << first.err;
  const config::Value table =
      config::parseFile(folder / "t/tables.json").get("tables").asArray()[0];
  EXPECT_EQ(table.get("columns").asArray()[2].asString(), "L1_8bit");
  EXPECT_EQ(table.get("rows").asArray()[1].asArray()[2].asString(), "18 (25, 13)");
  EXPECT_GT(table.get("rows").asArray()[0].asArray()[1].asNumber(), 0.0);
  EXPECT_THAT(first.err, HasSubstr("one: "));
  EXPECT_THAT(first.err, HasSubstr("two: "));
  EXPECT_THAT(textOf(folder / "t/tables.md"), HasSubstr("18 (25, 13)"));
  // Another text: nothing is rendered. Another setting of one run: that run alone.
  write("After", "1");
  const Result second = run(command);
  EXPECT_THAT(second.err, testing::Not(HasSubstr("frames rendered")));
  EXPECT_THAT(textOf(folder / "t/tables.md"), HasSubstr("After"));
  EXPECT_EQ(run(command + "--text-only").exitCode, 0);
  write("After", "2");
  EXPECT_EQ(run(command + "--text-only").exitCode, 2);
  const Result third = run(command);
  EXPECT_THAT(third.err, HasSubstr("one: "));
  EXPECT_THAT(third.err, testing::Not(HasSubstr("two: ")));
  // The page's own text stays
  std::ofstream(folder / "page.md") << "Text.\n\n<!-- table 1 -->\nold\n<!-- end -->\nMore.\n";
  EXPECT_EQ(run(command + "--into page.md").exitCode, 0);
  const std::string page = textOf(folder / "page.md");
  EXPECT_THAT(page, testing::StartsWith("Text.\n\n<!-- table 1 -->\n\n| run | ms |"));
  EXPECT_THAT(page, testing::EndsWith("<!-- end -->\nMore.\n"));
  EXPECT_THAT(page, testing::Not(HasSubstr("old")));
  std::ofstream(folder / "page.md") << "<!-- table 2 -->\n<!-- end -->\n";
  EXPECT_THAT(run(command + "--into page.md").err, HasSubstr("the suite has 1 tables"));
  std::ofstream(folder / "a.suite.json")
      << R"json({"title": "A", "runs": {"one": {"config": "run.json", "against": "truth"}},
 "tables": [{"title": "T", "columns": ["x"], "rows": [["ms(ome.reference)"]]}]})json";
  const Result wrong = run(command);
  EXPECT_EQ(wrong.exitCode, 2);
  EXPECT_THAT(wrong.err, HasSubstr("did you mean \"one\"?"));
  EXPECT_THAT(wrong.err, testing::Not(HasSubstr("frames rendered")));
}

}  // namespace
}  // namespace catoptric::app

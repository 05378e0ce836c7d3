// The commands layers and figure, as their users run them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>

#include "app/test_program.h"
#include "config/json.h"

namespace catoptric::app {
namespace {

using testing::HasSubstr;

TEST_F(App, LayersBecomePictures) {
  ASSERT_EQ(run("render run.json --frames 2,5 --out run --set 'image.layers=[\"s\",\"id\"]' "
                "--set image.masks=true")
                .exitCode,
            0);
  const Result all = run("layers run --out all");
  EXPECT_EQ(all.exitCode, 0) << all.err;
  EXPECT_EQ(std::count(all.out.begin(), all.out.end(), '\n'), 12);  // 2 frames: s, id, 4 masks
  EXPECT_TRUE(fs::exists(folder / "all/frame.0005.mask.sky.png"));
  const Result ids = run("layers run/frames/frame.0002.exr --layer id,mask --out some --json");
  EXPECT_EQ(config::parseText(ids.out, "out").asArray().size(), 5u);
  EXPECT_EQ(textOf(folder / "some/frame.0002.id.object.png"),
            textOf(folder / "all/frame.0002.id.object.png"));
  const Result none = run("layers run --layer clustr --out none");
  EXPECT_EQ(none.exitCode, 2);
  EXPECT_THAT(none.err, HasSubstr("it has no layer \"clustr\"; it has: "));
  ASSERT_EQ(run("render run.json --frames 2 --out plain --set 'image.layers=[]'").exitCode, 0);
  EXPECT_THAT(run("layers plain --out none").err, HasSubstr("the frames have only R, G, B and A"));
  EXPECT_EQ(run("layers run").exitCode, 2);
  EXPECT_FALSE(fs::exists(folder / "none"));
}

TEST_F(App, ComparedFramesBecomeAFilm) {
  ASSERT_EQ(run("render run.json --frames 1-3 --out a").exitCode, 0);
  ASSERT_EQ(run("render run.json --frames 1-3 --out b --set seed=7").exitCode, 0);
  // A program in ffmpeg's place tells what it was given
  fs::create_directories(folder / "bin");
  std::ofstream(folder / "bin/ffmpeg")
      << "#!/bin/sh\necho $* > told.txt\nls f.mp4.frames >> told.txt\n";
  fs::permissions(folder / "bin/ffmpeg", fs::perms::owner_all);
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", ((folder / "bin").string() + ":" + path).c_str(), 1);
  EXPECT_EQ(run("compare b a --video f.mp4").exitCode, 0);
  EXPECT_THAT(textOf(folder / "told.txt"),
              testing::AllOf(HasSubstr("-framerate 30 -i f.mp4.frames/%04d.png "),
                             HasSubstr(" f.mp4\n0001.png\n0002.png\n0003.png\n")));
  EXPECT_FALSE(fs::exists(folder / "f.mp4.frames"));
  std::ofstream(folder / "bin/ffmpeg") << "#!/bin/sh\nls -L r.traced.mp4.frames > told.txt\n";
  EXPECT_EQ(run("render run.json --frames 1,3 --out c --camera turntable:4 --video r.traced.mp4 "
                "--method traced")
                .exitCode,
            0);
  EXPECT_EQ(textOf(folder / "told.txt"), "0001.png\n0002.png\n");
  std::ofstream(folder / "r.mp4") << "a film";
  const Result refused = run("render run.json --method traced --out d --video r.mp4");
  EXPECT_EQ(refused.exitCode, 2);
  EXPECT_THAT(refused.err, HasSubstr("r.mp4 exists; remove it"));
  EXPECT_FALSE(fs::exists(folder / "d"));
  ::setenv("PATH", "", 1);
  const Result without = run("compare b a --video f.mp4");
  const std::string render = "render run.json --frames 1,3 --method traced --out e --video e.mp4";
  const Result filmless = run(render);
  const Result again = run(render + " --existing resume");
  ::setenv("PATH", path.c_str(), 1);
  for (const Result& result : {filmless, again}) {
    EXPECT_EQ(result.exitCode, 5) << result.err;
    EXPECT_THAT(result.err, HasSubstr("warning: --video e.mp4: there is no ffmpeg here"));
    EXPECT_THAT(result.err, HasSubstr("error: e.mp4: not made, for want of ffmpeg"));
    EXPECT_THAT(result.out, HasSubstr("frame"));
    EXPECT_TRUE(fs::exists(folder / "e.mp4.frames/0002.png"));
  }
  std::ofstream(folder / "bin/ffmpeg") << "#!/bin/sh\nexit 1\n";
  ::setenv("PATH", ((folder / "bin").string() + ":" + path).c_str(), 1);
  const Result failed = run(render + " --existing resume");
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(failed.exitCode, 5);
  EXPECT_THAT(failed.err, HasSubstr("e.mp4: ffmpeg failed"));
  EXPECT_EQ(without.exitCode, 5);
  EXPECT_THAT(without.err, HasSubstr("there is no ffmpeg here. With it, this command makes"));
  EXPECT_THAT(without.err, HasSubstr("error: f.mp4: not made, for want of ffmpeg"));
  EXPECT_THAT(without.err, Not(HasSubstr("sh:")));
  EXPECT_TRUE(fs::exists(folder / "f.mp4.frames/0003.png"));
  EXPECT_THAT(run("compare b a --video f.mp4").err, HasSubstr("exists; remove it"));
}

TEST_F(App, FramesBecomeFigures) {
  ASSERT_EQ(run("render run.json --frames 2,5 --out run --set image.masks=true").exitCode, 0);
  ASSERT_EQ(run("render run.json --frames 2,5 --out other --set seed=7").exitCode, 0);
  for (const char* file : {"a.png", "a.pdf", "a.svg"}) {
    const Result made = run(std::string("figure run other --frame 2,5 --against other "
                                        "--difference 9 --labels one,two --crop 1,2,3,2 --zoom 64 "
                                        "--out ") +
                            file);
    EXPECT_EQ(made.exitCode, 0) << made.err;
  }
  const std::string svg = textOf(folder / "a.svg");
  EXPECT_THAT(svg, HasSubstr(">one, crop L1_8bit "));
  EXPECT_THAT(svg, HasSubstr(">two</text>"));
  EXPECT_THAT(svg, HasSubstr(">difference x9</text>"));
  EXPECT_THAT(svg, HasSubstr(">frame 5</text>"));
  EXPECT_THAT(svg, HasSubstr("width=\"192\" height=\"128\""));
  const std::map<std::string, std::string> wrong{
      {"--frame 3", "run: it has no frame 3; it has 2 frames from 2 to 5"},
      {"--crop 0,0,9999,1", "is outside the frame"},
      {"--crop 1,2,3", "must be X,Y,WIDTH,HEIGHT"},
      {"--layer clustr", "it has no layer \"clustr\""},
      {"--mask skyy", "it has no layer \"mask.skyy\""},
      {"--difference 5", "--difference needs --against"},
      {"--against gone", "gone: no such file or folder"},
      {"--labels a,b,c", "--labels has 3 texts for 1 runs"},
      {"--out figure.jpg", "must end in .png, .pdf or .svg"}};
  for (const auto& [options, message] : wrong) {
    const bool named = options.starts_with("--out");
    const Result result = run("figure run " + options + (named ? "" : " --out wrong.png"));
    EXPECT_EQ(result.exitCode, 2) << options;
    EXPECT_THAT(result.err, HasSubstr(message));
  }
  EXPECT_FALSE(fs::exists(folder / "wrong.png"));
  ASSERT_EQ(run("render run.json --frames 5,6 --out later").exitCode, 0);
  ASSERT_EQ(run("render run.json --frames 4 --out none").exitCode, 0);
  EXPECT_EQ(run("figure run later --out common.png").exitCode, 0);
  ASSERT_EQ(run("figure run later --frame 5 --out asked.png").exitCode, 0);
  EXPECT_EQ(textOf(folder / "common.png"), textOf(folder / "asked.png"));
  EXPECT_EQ(run("figure run --against later --out against.png").exitCode, 0);
  EXPECT_EQ(run("figure run later/frames/frame.0006.exr --out file.png").exitCode, 0);
  EXPECT_THAT(run("figure run none --out wrong.png").err, HasSubstr("none: it has no frame 2"));
}

}  // namespace
}  // namespace catoptric::app

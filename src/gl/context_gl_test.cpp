#include "gl/context.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>

#include "core/error.h"
#include "core/log.h"
#include "core/parallel.h"
#include "gl/api.h"
#include "gl/doctor.h"
#include "gl/objects.h"
#include "gl/shader.h"
#include "gl/test_context.h"

namespace catoptric::gl {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Property;
using testing::Throws;

// One texel drawn with this context, to see that it is alive: value 0.25 + 0.5.
float drawnValue() {
  const Texture color = Texture::make2D("probe", GL_RGBA32F, 1, 1);
  const Framebuffer target("probe", {{color}});
  Program program = Program::fullScreen("probe", "gl/testdata/pattern.frag", {{"SCALE", "3.0"}});
  target.bind();
  target.clearColor(0, 0, 0, 0, 0);
  program.use();
  program.set("color", Vec4(0.25f));
  drawFullScreenTriangle();
  checkErrors("drawnValue");
  return color.read<float>(0, GL_RGBA, GL_FLOAT, 4)[0];
}

TEST(Context, DescribesItsDevice) {
  const Context& context = testContext();
  const DeviceInfo& info = context.info();
  EXPECT_NE(info.renderer, "");
  EXPECT_NE(info.vendor, "");
  EXPECT_NE(info.glslVersion, "");
  EXPECT_NE(info.platformVersion, "");
  if (!testDevice().automatic) {
    EXPECT_EQ(info.device, testDevice().text());
  }
  EXPECT_GE(std::atof(info.version.c_str()), 4.5);
  // The program draws without GPU here; timer queries are not to be believed then.
  if (info.renderer.find("llvmpipe") != std::string::npos) {
    EXPECT_TRUE(info.software);
    EXPECT_EQ(info.timer, TimerKind::FinishClock);
  }
  // The least values that OpenGL 4.5 allows.
  EXPECT_GE(info.limits.maxTextureSize, 16384);
  EXPECT_GE(info.limits.maxArrayLayers, 2048);
  EXPECT_GE(info.limits.maxColorAttachments, 8);
  EXPECT_GE(info.limits.maxTextureBufferTexels, 65536);
  EXPECT_GE(info.limits.maxStorageBufferBytes, std::int64_t{1} << 27);
  EXPECT_GE(info.limits.maxViewports, 16);
  EXPECT_TRUE(context.has("GL_ARB_clip_control"));
  EXPECT_FALSE(context.has("GL_ARB_not_an_extension"));
}

TEST(Context, HasTheFixedState) {
  testContext();
  GLint origin = 0;
  GLint depth = 0;
  glGetIntegerv(GL_CLIP_ORIGIN, &origin);
  glGetIntegerv(GL_CLIP_DEPTH_MODE, &depth);
  EXPECT_EQ(origin, GL_UPPER_LEFT);
  EXPECT_EQ(depth, GL_ZERO_TO_ONE);
  EXPECT_TRUE(glIsEnabled(GL_TEXTURE_CUBE_MAP_SEAMLESS));
}

TEST(Context, TurnsErrorsIntoExceptionsOnce) {
  Context& context = testContext();
  glEnable(GL_TEXTURE_2D + 12345);
  EXPECT_THAT([&] { context.check("the step"); },
              Throws<Error>(
                  Property(&Error::what, AllOf(HasSubstr("the step"), HasSubstr("GL_INVALID_ENUM"),
                                               HasSubstr("driver: ")))));
  EXPECT_NO_THROW(context.check("the next step"));
}

TEST(Context, OutOfMemoryIsExit8) {
  Context& context = testContext();
  GLuint buffer = 0;
  glCreateBuffers(1, &buffer);
  glNamedBufferStorage(buffer, GLsizeiptr{1} << 46, nullptr, 0);
  EXPECT_THAT([&] { context.check("the step"); },
              Throws<Error>(Property(&Error::code, ExitCode::OutOfMemory)));
  glDeleteBuffers(1, &buffer);
}

TEST(Context, RefusesADeviceThatIsNotThere) {
  // The context in use survives the failed attempt.
  testContext();
  const std::uint32_t serial = Context::currentSerial();
  EXPECT_THAT([] { Context missing(parseDevice("egl:99")); },
              Throws<DeviceError>(Property(&DeviceError::what,
                                           AllOf(HasSubstr("device egl:99 cannot be used"),
                                                 HasSubstr("What to do: "), HasSubstr("doctor")))));
  EXPECT_EQ(Context::currentSerial(), serial);
  EXPECT_EQ(drawnValue(), 0.75f);
}

TEST(Context, AllPlatformsAfterEachOtherInOneProcess) {
  Context& shared = testContext();
  for (int round = 0; round < 2; ++round) {
    for (const char* name : {"surfaceless", "osmesa", "egl:0"}) {
      SCOPED_TRACE(name);
      Context context(parseDevice(name));
      EXPECT_EQ(context.info().device, name);
      EXPECT_EQ(&Context::current(), &context);
      EXPECT_EQ(drawnValue(), 0.75f);
    }
    EXPECT_FALSE(Context::hasCurrent());
    shared.makeCurrent();
    EXPECT_EQ(drawnValue(), 0.75f);
  }
}

TEST(Context, TwoAtOnceKeepTheirObjects) {
  Context& first = testContext();
  Texture one = Texture::make2D("one", GL_R32F, 1, 1);
  const float value = 1.0f;
  one.upload(0, 0, GL_RED, GL_FLOAT, &value);
  {
    // The other family of drivers, which shares Mesa's notion of the current context.
    Context second(
        parseDevice(first.info().platform == Platform::OsMesa ? "surfaceless" : "osmesa"));
    Texture two = Texture::make2D("two", GL_R32F, 1, 1);
    const float other = 2.0f;
    two.upload(0, 0, GL_RED, GL_FLOAT, &other);
    first.makeCurrent();
    EXPECT_EQ(one.read<float>(0, GL_RED, GL_FLOAT, 1)[0], 1.0f);
    second.makeCurrent();
    EXPECT_EQ(two.read<float>(0, GL_RED, GL_FLOAT, 1)[0], 2.0f);
    EXPECT_EQ(drawnValue(), 0.75f);
  }
  first.makeCurrent();
  EXPECT_EQ(one.read<float>(0, GL_RED, GL_FLOAT, 1)[0], 1.0f);
}

TEST(Context, MovesAndForgets) {
  Context& shared = testContext();
  const Texture hostage = Texture::make2D("hostage", GL_R8, 1, 1);
  {
    Texture survivor;
    {
      Context context(parseDevice("osmesa"));
      const Context moved(std::move(context));
      EXPECT_EQ(&Context::current(), &moved);
      // A texture of the same number as the other context's.
      std::vector<Texture> others;
      while (survivor.id() != hostage.id() && others.size() < 1000) {
        others.push_back(std::move(survivor));
        survivor = Texture::make2D("survivor", GL_R8, 1, 1);
      }
      ASSERT_EQ(survivor.id(), hostage.id());
    }
    // Outlived its context: nothing to delete, and nothing of another context is hit.
    shared.makeCurrent();
  }
  EXPECT_TRUE(glIsTexture(hostage.id()));
  EXPECT_NO_THROW(shared.check("the end of a forgotten texture"));
}

TEST(Doctor, TriesEveryDeviceAndKeepsTheCurrentContext) {
  testContext();
  const std::uint32_t serial = Context::currentSerial();
  const std::vector<DeviceReport> reports = describeDevices();
  EXPECT_EQ(Context::currentSerial(), serial);
  EXPECT_EQ(drawnValue(), 0.75f);

  ASSERT_GE(reports.size(), 3u);
  EXPECT_EQ(reports.front().device, "egl:0");
  EXPECT_EQ(reports[reports.size() - 2].device, "surfaceless");
  EXPECT_EQ(reports.back().device, "osmesa");
  for (const DeviceReport& report : reports) {
    SCOPED_TRACE(report.device);
    if (report.usable()) {
      EXPECT_NE(report.renderer, "");
      EXPECT_FALSE(report.limits.empty());
      EXPECT_EQ(report.whatToDo, "");
    } else {
      EXPECT_NE(report.message, "");
      EXPECT_NE(report.whatToDo, "");
    }
  }
  const std::string text = doctorText(reports);
  EXPECT_THAT(
      text, AllOf(HasSubstr("surfaceless: "), HasSubstr("osmesa: "), HasSubstr("texture size: ")));
}

void limitAddressSpace() {
  const rlimit space{rlim_t{300} << 20, rlim_t{300} << 20};
  ::setrlimit(RLIMIT_AS, &space);
}

// EGL finds no driver but one that crashes when it is loaded.
void useDeadDriver() {
  const std::string file = testing::TempDir() + "dead_driver." + testDevice().text() + ".json";
  std::ofstream(file) << R"({"file_format_version": "1.0.0", "ICD": {"library_path": ")"
                      << CATOPTRIC_DEAD_DRIVER << "\"}}";
  setenv("__EGL_VENDOR_LIBRARY_FILENAMES", file.c_str(), 1);
}

// In processes of their own, since Mesa reads its environment once.
[[noreturn]] void tryInFreshProcess(const char* device) {
  try {
    const Context context(parseDevice(device));
    std::fprintf(stderr, "took %s\n", context.info().device.c_str());
    std::_Exit(0);
  } catch (const DeviceError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::_Exit(static_cast<int>(error.code()));
  }
}

TEST(ContextDeathTest, RefusesAnOldDriverAndSaysWhy) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  for (const char* device : {"surfaceless", "osmesa"}) {
    EXPECT_EXIT(
        {
          setenv("MESA_GL_VERSION_OVERRIDE", "3.3", 1);
          tryInFreshProcess(device);
        },
        testing::ExitedWithCode(4), "cannot be used.*4\\.5 core");
  }
}

/// Threads of this process whose names begin with "llvmpipe".
int rasterizerThreads() {
  int count = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::ifstream(task.path() / "comm") >> name;
    count += name.starts_with("llvmpipe") ? 1 : 0;
  }
  return count;
}

TEST(ContextDeathTest, TheNumberOfThreadsBoundsLlvmpipe) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  for (const auto& [threads, expected] : {std::pair(1, 0), std::pair(2, 2), std::pair(3, 3)})
    for (const char* device : {"surfaceless", "osmesa"}) {
      EXPECT_EXIT(
          {
            setThreadCount(threads);
            const Context context(parseDevice(device));
            drawnValue();
            const bool software = context.info().renderer.find("llvmpipe") != std::string::npos;
            // A thread names itself a little after it has begun
            for (int i = 0; i < 500 && software && rasterizerThreads() != expected; ++i)
              std::this_thread::sleep_for(std::chrono::milliseconds(10));
            std::fprintf(stderr, "%d threads\n", rasterizerThreads());
            std::_Exit(software && rasterizerThreads() != expected ? 1 : 0);
          },
          testing::ExitedWithCode(0), "");
    }
}

TEST(ContextDeathTest, AutoListsEverythingItTried) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("MESA_GL_VERSION_OVERRIDE", "3.3", 1);
        tryInFreshProcess("auto");
      },
      testing::ExitedWithCode(4), "Tried:(.|\n)*egl:(.|\n)*surfaceless: (.|\n)*osmesa: ");
}

TEST(ContextDeathTest, AutoSaysWhichDeviceItTook) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        log::setLevel(log::Level::Info);
        tryInFreshProcess("auto");
      },
      testing::ExitedWithCode(0), "device egl:[0-9]+ \\(auto\\): (.|\n)*took egl:");
}

TEST(ContextDeathTest, ADriverThatCrashesTakesNobodyWithIt) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        useDeadDriver();
        tryInFreshProcess("auto");
      },
      testing::ExitedWithCode(0), "took osmesa");
  EXPECT_EXIT(
      {
        useDeadDriver();
        tryInFreshProcess("surfaceless");
      },
      testing::ExitedWithCode(4), "surfaceless cannot be used: the driver crashed .SIGSEGV: Seg");
  EXPECT_EXIT(
      {
        useDeadDriver();
        std::fputs(doctorText(describeDevices()).c_str(), stderr);
        std::_Exit(0);
      },
      testing::ExitedWithCode(0),
      "egl:0: unusable\n *problem *the driver crashed .SIGSEGV(.|\n)*surfaceless: "
      "unusable(.|\n)*osmesa: software");
#ifndef __SANITIZE_ADDRESS__  // which reserves more
  // Too little address space for a driver: it dies or says so.
  EXPECT_EXIT(
      {
        limitAddressSpace();
        std::fputs(doctorText(describeDevices()).c_str(), stderr);
        std::_Exit(0);
      },
      testing::ExitedWithCode(0), "egl:0: (.|\n)*surfaceless: (.|\n)*osmesa: ");
#endif
}

// Without any vendor library EGL has no devices and no surfaceless platform: auto takes OSMesa.
TEST(ContextDeathTest, AutoFallsThroughToOsMesa) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null", 1);
        tryInFreshProcess("auto");
      },
      testing::ExitedWithCode(0), "took osmesa");
}

}  // namespace
}  // namespace catoptric::gl

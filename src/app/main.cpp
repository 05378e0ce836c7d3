// catoptric's entry: errors become exit codes.
#include <csignal>
#include <exception>
#include <filesystem>
#include <new>

#include "app/commands.h"
#include "core/log.h"

namespace {

int fail(const std::string& message, catoptric::ExitCode code) {
  catoptric::log::error(message);
  return static_cast<int>(code);
}

int failInternally(const std::string& message) {
  return fail("internal error: " + message + " (please report it)", catoptric::ExitCode::Internal);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace catoptric;
  // A closed pipe and a file size limit are errors of a write, not the end of the process.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return static_cast<int>(app::runProgram({argv + 1, argv + argc}));
  } catch (const Error& error) {
    if (error.code() == ExitCode::Internal) return failInternally(error.what());
    return fail(error.what(), error.code());
  } catch (const app::ReaderGone&) {
    return 128 + SIGPIPE;
  } catch (const std::bad_alloc&) {
    return fail("out of memory", ExitCode::OutOfMemory);
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(error.what(), ExitCode::Output);
  } catch (const std::exception& error) {
    return failInternally(error.what());
  }
}

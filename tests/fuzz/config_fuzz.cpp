#include "config/json.h"
#include "core/error.h"
#include "memory_file.h"
#include "run/config/run_config.h"

using namespace catoptric;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const config::Value root =
        config::parseText({reinterpret_cast<const char*>(data), size}, "fuzz.json");
    run::fileKind(root);
    run::readRunConfig(root, "fuzz.json", methods::registry(), {});
  } catch (const Error&) {
  }
  return 0;
}

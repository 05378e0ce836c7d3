#include <algorithm>

#include "methods/contract/method.h"

// One line per method, in the order of `catoptric list`: the function of its folder that gives its
// entry.
#define CATOPTRIC_METHODS(METHOD) \
  METHOD(environmentMapEntry)     \
  METHOD(screenSpaceEntry)        \
  METHOD(planarEntry)             \
  METHOD(tracedEntry)             \
  METHOD(secondOrderEntry)        \
  METHOD(perturbationEntry)       \
  METHOD(reprojectionEntry)       \
  METHOD(billboardsEntry)         \
  METHOD(depthImpostorsEntry)     \
  METHOD(glossyLodEntry)          \
  METHOD(referenceEntry)          \
  CATOPTRIC_TEST_METHODS(METHOD)

// Tests compile this file once more with a method of their own.
#ifdef CATOPTRIC_TEST_METHOD
#define CATOPTRIC_TEST_METHODS(METHOD) METHOD(CATOPTRIC_TEST_METHOD)
#else
#define CATOPTRIC_TEST_METHODS(METHOD)
#endif

namespace catoptric::methods {

#define CATOPTRIC_DECLARE(entry) const MethodEntry& entry();
CATOPTRIC_METHODS(CATOPTRIC_DECLARE)
#undef CATOPTRIC_DECLARE

const std::vector<MethodEntry>& registry() {
#define CATOPTRIC_CALL(entry) entry(),
  static const std::vector<MethodEntry> entries = {CATOPTRIC_METHODS(CATOPTRIC_CALL)};
#undef CATOPTRIC_CALL
  return entries;
}

const MethodEntry* findMethod(const std::vector<MethodEntry>& registry, const std::string& name) {
  const auto found = std::ranges::find_if(registry, [&](const MethodEntry& entry) {
    return entry.id == name ||
           std::ranges::find(entry.aliases, name, &MethodAlias::id) != entry.aliases.end();
  });
  return found == registry.end() ? nullptr : &*found;
}

}  // namespace catoptric::methods

// Entries of a run config's `methods`: a method with its options, and the methods beside it.
#pragma once

#include <string>
#include <vector>

#include "config/json.h"
#include "config/json_text.h"
#include "methods/contract/method.h"

namespace catoptric::run {

/// A member of an entry's `reflectors`: assigns some reflective objects to a method.
struct ReflectorRule {
  std::string pattern;    ///< an object's name; with a trailing *, a prefix of names; or a kind
  std::string id;         ///< the method's id in the registry
  config::Value options;  ///< checked against the method's schema
  std::string effective;  ///< canonical JSON of the options, with defaults
  config::Value place;    ///< the place in the config, for messages
};

/// One entry of `methods`: a method with its options, under its own name.
struct MethodConfig {
  std::string name;       ///< used for the folder of its frames and its row in tables
  std::string id;         ///< the method's id in the registry
  config::Value options;  ///< checked against the method's schema
  std::string effective;  ///< canonical JSON of the options, with defaults
  std::vector<ReflectorRule> reflectors = {};  ///< the method itself shades all other reflectors
  /// The id of the method that shades reflectors which the entry's method does not support;
  /// "error": there is none, and the run fails.
  std::string unsupported = "error";
  /// The method that renders the samples which the entry's method leaves; at most one.
  std::vector<MethodConfig> fallback = {};
  config::Value place = {};  ///< the place in the config, for messages

  /// Adds everything that determines the method's pixels: method, options, reflectors,
  /// unsupported, fallback.
  void addSettings(config::JsonText& text) const;
};

/// The ids of methods that may shade reflectors which another method does not support.
std::vector<std::string> fallbackMethods();
/// The schema of one entry of `methods`: name, method, the methods beside it, and the method's own
/// options. Without `isEntry` that of a method of `reflectors`: the method and its options.
config::Schema methodSchema(const methods::MethodEntry& entry, bool isEntry = true);

/// All entries of the config's `methods`, each checked against its schema. A name twice is an
/// error.
std::vector<MethodConfig> readMethods(const config::Value& methods,
                                      const std::vector<methods::MethodEntry>& registry,
                                      config::Errors& errors);
/// --method: of `all`, the entries of each name, else those of that method, else its defaults.
std::vector<MethodConfig> selectMethods(const std::vector<MethodConfig>& all,
                                        const std::vector<std::string>& selected,
                                        const std::vector<methods::MethodEntry>& registry,
                                        config::Errors& errors);

/// The name of an entry of `methods`; empty: it has none.
std::string entryName(const config::Value& entry);

}  // namespace catoptric::run

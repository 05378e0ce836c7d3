#include "config/patch.h"

#include <nlohmann/json.hpp>
#include <string_view>

namespace catoptric::config {

std::string patched(const Value& root, const Value& operations) {
  using OrderedJson = nlohmann::ordered_json;  // members keep their order
  try {
    return OrderedJson::parse(root.dump()).patch(OrderedJson::parse(operations.dump())).dump(1);
  } catch (const OrderedJson::exception& error) {
    const std::string_view said = error.what();  // "[json.exception.out_of_range.403] key 'a' ..."
    operations.fail("this patch cannot be applied to " + root.place().file + ": " +
                    std::string(said.substr(said.find("] ") + 2)));
  }
}

}  // namespace catoptric::config

// A scalar with 50 digits, for tests that check derivatives and roots.
#pragma once

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace catoptric::implicit {

using Real = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>,
                                           boost::multiprecision::et_off>;

}  // namespace catoptric::implicit

// Vectors of CATOPTRIC_LANES (4 or 8) lanes for walk.h. Only traversal.cpp includes this file, in a
// namespace for each number of lanes. NOLINT(llvm-header-guard)
struct V {
  static constexpr std::size_t kLanes = CATOPTRIC_LANES;
  using F = Lanes<float, kLanes>;
  using I = Lanes<std::int32_t, kLanes>;
  using M = I;
  CATOPTRIC_OP F all(float x) { return x - F{}; }
  CATOPTRIC_OP I all(std::uint32_t x) { return static_cast<std::int32_t>(x) - I{}; }
  // Clang refuses functions that return a vector without its target, so load() and root() of
  // core/lanes.h cannot be called.
  CATOPTRIC_OP F load(const float* p) {
    F loaded;
    __builtin_memcpy(&loaded, p, sizeof loaded);
    return loaded;
  }
  CATOPTRIC_OP I load(const std::uint32_t* p) {
    I loaded;
    __builtin_memcpy(&loaded, p, sizeof loaded);
    return loaded;
  }
  CATOPTRIC_OP void store(float* p, F x) { catoptric::store(x, p); }
  CATOPTRIC_OP void store(std::uint32_t* p, I x) { catoptric::store(x, p); }
  CATOPTRIC_OP F add(F a, F b) { return a + b; }
  CATOPTRIC_OP F sub(F a, F b) { return a - b; }
  CATOPTRIC_OP F mul(F a, F b) { return a * b; }
  CATOPTRIC_OP F div(F a, F b) { return a / b; }
  CATOPTRIC_OP F root(F a) {
    std::array<float, kLanes> roots;
    catoptric::store(a, roots.data());
    for (float& value : roots) value = std::sqrt(value);
    return load(roots.data());
  }
  CATOPTRIC_OP F least(F a, F b) { return a < b ? a : b; }
  CATOPTRIC_OP F most(F a, F b) { return a > b ? a : b; }
  CATOPTRIC_OP F magnitude(F a) { return a < 0.0f ? -a : a; }
  CATOPTRIC_OP M le(F a, F b) { return a <= b; }
  CATOPTRIC_OP M lt(F a, F b) { return a < b; }
  CATOPTRIC_OP M le(I a, I b) { return a <= b; }
  CATOPTRIC_OP M both(M a, M b) { return a & b; }
  CATOPTRIC_OP M either(M a, M b) { return a | b; }
  CATOPTRIC_OP M without(M a, M b) { return a & ~b; }
  CATOPTRIC_OP unsigned bits(M a) {
#if CATOPTRIC_LANES == 8
    return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(a)));
#else
    return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(a)));
#endif
  }
  CATOPTRIC_OP M fromBits(unsigned a) {
#if CATOPTRIC_LANES == 8
    const M bit{1, 2, 4, 8, 16, 32, 64, 128};
#else
    const M bit{1, 2, 4, 8};
#endif
    return (all(a) & bit) == bit;
  }
  CATOPTRIC_OP F pick(M m, F yes, F no) {
    return m ? yes : no;
  }
  CATOPTRIC_OP I pick(M m, I yes, I no) {
    return m ? yes : no;
  }
};

// Vectors of 4 for walk.h: included by traversal.cpp alone, in a namespace.
// NOLINT(llvm-header-guard)
struct V {
  static constexpr std::size_t kLanes = 4;
  using F = __m128;
  using I = __m128i;
  using M = __m128;
#define CATOPTRIC_OP CATOPTRIC_TARGET [[gnu::always_inline]] static inline
  CATOPTRIC_OP F all(float x) {
    return _mm_set1_ps(x);
  }
  CATOPTRIC_OP I all(std::uint32_t x) {
    return _mm_set1_epi32(static_cast<int>(x));
  }
  CATOPTRIC_OP F load(const float* p) {
    return _mm_loadu_ps(p);
  }
  CATOPTRIC_OP I load(const std::uint32_t* p) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
  }
  CATOPTRIC_OP void store(float* p, F x) {
    _mm_storeu_ps(p, x);
  }
  CATOPTRIC_OP void store(std::uint32_t* p, I x) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(p), x);
  }
  CATOPTRIC_OP F add(F a, F b) {
    return _mm_add_ps(a, b);
  }
  CATOPTRIC_OP F sub(F a, F b) {
    return _mm_sub_ps(a, b);
  }
  CATOPTRIC_OP F mul(F a, F b) {
    return _mm_mul_ps(a, b);
  }
  CATOPTRIC_OP F div(F a, F b) {
    return _mm_div_ps(a, b);
  }
  CATOPTRIC_OP F root(F a) {
    return _mm_sqrt_ps(a);
  }
  CATOPTRIC_OP F least(F a, F b) {
    return _mm_min_ps(a, b);
  }
  CATOPTRIC_OP F most(F a, F b) {
    return _mm_max_ps(a, b);
  }
  CATOPTRIC_OP F magnitude(F a) {
    return _mm_andnot_ps(_mm_set1_ps(-0.0f), a);
  }
  CATOPTRIC_OP M le(F a, F b) {
    return _mm_cmple_ps(a, b);
  }
  CATOPTRIC_OP M lt(F a, F b) {
    return _mm_cmplt_ps(a, b);
  }
  CATOPTRIC_OP M le(I a, I b) {
    return _mm_castsi128_ps(_mm_xor_si128(_mm_cmpgt_epi32(a, b), _mm_set1_epi32(-1)));
  }
  CATOPTRIC_OP M both(M a, M b) {
    return _mm_and_ps(a, b);
  }
  CATOPTRIC_OP M either(M a, M b) {
    return _mm_or_ps(a, b);
  }
  CATOPTRIC_OP M without(M a, M b) {
    return _mm_andnot_ps(b, a);
  }
  CATOPTRIC_OP unsigned bits(M a) {
    return static_cast<unsigned>(_mm_movemask_ps(a));
  }
  CATOPTRIC_OP M fromBits(unsigned a) {
    const I bit = _mm_setr_epi32(1, 2, 4, 8);
    return _mm_castsi128_ps(
        _mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(static_cast<int>(a)), bit), bit));
  }
  CATOPTRIC_OP F pick(M m, F yes, F no) {
    return _mm_or_ps(_mm_and_ps(m, yes), _mm_andnot_ps(m, no));
  }
  CATOPTRIC_OP I pick(M m, I yes, I no) {
    return _mm_castps_si128(pick(m, _mm_castsi128_ps(yes), _mm_castsi128_ps(no)));
  }
#undef CATOPTRIC_OP
};

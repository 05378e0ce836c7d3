// Vectors of 8 for walk.h: included by traversal.cpp alone, in a namespace.
// NOLINT(llvm-header-guard)
struct V {
  static constexpr std::size_t kLanes = 8;
  using F = __m256;
  using I = __m256i;
  using M = __m256;
#define CATOPTRIC_OP CATOPTRIC_TARGET [[gnu::always_inline]] static inline
  CATOPTRIC_OP F all(float x) {
    return _mm256_set1_ps(x);
  }
  CATOPTRIC_OP I all(std::uint32_t x) {
    return _mm256_set1_epi32(static_cast<int>(x));
  }
  CATOPTRIC_OP F load(const float* p) {
    return _mm256_loadu_ps(p);
  }
  CATOPTRIC_OP I load(const std::uint32_t* p) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
  }
  CATOPTRIC_OP void store(float* p, F x) {
    _mm256_storeu_ps(p, x);
  }
  CATOPTRIC_OP void store(std::uint32_t* p, I x) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), x);
  }
  CATOPTRIC_OP F add(F a, F b) {
    return _mm256_add_ps(a, b);
  }
  CATOPTRIC_OP F sub(F a, F b) {
    return _mm256_sub_ps(a, b);
  }
  CATOPTRIC_OP F mul(F a, F b) {
    return _mm256_mul_ps(a, b);
  }
  CATOPTRIC_OP F div(F a, F b) {
    return _mm256_div_ps(a, b);
  }
  CATOPTRIC_OP F root(F a) {
    return _mm256_sqrt_ps(a);
  }
  CATOPTRIC_OP F least(F a, F b) {
    return _mm256_min_ps(a, b);
  }
  CATOPTRIC_OP F most(F a, F b) {
    return _mm256_max_ps(a, b);
  }
  CATOPTRIC_OP F magnitude(F a) {
    return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a);
  }
  CATOPTRIC_OP M le(F a, F b) {
    return _mm256_cmp_ps(a, b, _CMP_LE_OQ);
  }
  CATOPTRIC_OP M lt(F a, F b) {
    return _mm256_cmp_ps(a, b, _CMP_LT_OQ);
  }
  CATOPTRIC_OP M le(I a, I b) {
    return _mm256_castsi256_ps(_mm256_xor_si256(_mm256_cmpgt_epi32(a, b), _mm256_set1_epi32(-1)));
  }
  CATOPTRIC_OP M both(M a, M b) {
    return _mm256_and_ps(a, b);
  }
  CATOPTRIC_OP M either(M a, M b) {
    return _mm256_or_ps(a, b);
  }
  CATOPTRIC_OP M without(M a, M b) {
    return _mm256_andnot_ps(b, a);
  }
  CATOPTRIC_OP unsigned bits(M a) {
    return static_cast<unsigned>(_mm256_movemask_ps(a));
  }
  CATOPTRIC_OP M fromBits(unsigned a) {
    const I bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    return _mm256_castsi256_ps(
        _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(static_cast<int>(a)), bit), bit));
  }
  CATOPTRIC_OP F pick(M m, F yes, F no) {
    return _mm256_blendv_ps(no, yes, m);
  }
  CATOPTRIC_OP I pick(M m, I yes, I no) {
    return _mm256_castps_si256(
        _mm256_blendv_ps(_mm256_castsi256_ps(no), _mm256_castsi256_ps(yes), m));
  }
#undef CATOPTRIC_OP
};

#include "optimizer/nlp/chain_ldl_kernel.h"

#include <cstring>

namespace sparflow::detail {
namespace {

typedef double LdlLanes __attribute__((vector_size(32)));
// no threshold: width of a vector
constexpr int kLanes = 4;

#define SPARFLOW_INLINE inline __attribute__((always_inline))

SPARFLOW_INLINE void load(const double* from, LdlLanes& v) { std::memcpy(&v, from, sizeof v); }
SPARFLOW_INLINE void store(double* to, const LdlLanes& v) { std::memcpy(to, &v, sizeof v); }

SPARFLOW_INLINE double largest_entry(int size, const double* column) {
  LdlLanes most = {0.0, 0.0, 0.0, 0.0}, a;
  for (int i = 0; i < size; i += kLanes) {
    load(column + i, a);
    a = a < 0.0 ? -a : a;
    most = a > most ? a : most;
  }
  const double first = most[0] > most[1] ? most[0] : most[1];
  const double second = most[2] > most[3] ? most[2] : most[3];
  return first > second ? first : second;
}

SPARFLOW_INLINE void update_columns(double* f, int stride, int first, int last, int size,
                                    const double* l1, const double* w1, const double* l2,
                                    const double* w2) {
  LdlLanes a, b, c;
  for (int column = first; column < last; ++column) {
    double* to = f + static_cast<long>(column) * stride;
    if (l2 == nullptr) {
      for (int i = column; i < size; i += kLanes) {
        load(to + i, a);
        load(l1 + i, b);
        store(to + i, a - b * w1[column]);
      }
    } else {
      for (int i = column; i < size; i += kLanes) {
        load(to + i, a);
        load(l1 + i, b);
        load(l2 + i, c);
        store(to + i, a - b * w1[column] - c * w2[column]);
      }
    }
  }
}

SPARFLOW_INLINE void subtract_product(double* f, int stride, int first, int size, const double* l,
                                      const double* w, int count) {
  int column = first;
  for (; column + 4 <= size;
       column += 4) {  // entries above the diagonal are written but never read
    double* to = f + static_cast<long>(column) * stride;
    int i = column;
    for (; i + kLanes < size; i += 2 * kLanes) {
      LdlLanes c00, c01, c10, c11, c20, c21, c30, c31, a, b;
      load(to + i, c00);
      load(to + i + kLanes, c01);
      load(to + stride + i, c10);
      load(to + stride + i + kLanes, c11);
      load(to + 2 * stride + i, c20);
      load(to + 2 * stride + i + kLanes, c21);
      load(to + 3 * stride + i, c30);
      load(to + 3 * stride + i + kLanes, c31);
      const double* lk = l + i;
      const double* wk = w + column;
      for (int k = 0; k < count; ++k, lk += stride, wk += stride) {
        load(lk, a);
        load(lk + kLanes, b);
        c00 -= a * wk[0];
        c01 -= b * wk[0];
        c10 -= a * wk[1];
        c11 -= b * wk[1];
        c20 -= a * wk[2];
        c21 -= b * wk[2];
        c30 -= a * wk[3];
        c31 -= b * wk[3];
      }
      store(to + i, c00);
      store(to + i + kLanes, c01);
      store(to + stride + i, c10);
      store(to + stride + i + kLanes, c11);
      store(to + 2 * stride + i, c20);
      store(to + 2 * stride + i + kLanes, c21);
      store(to + 3 * stride + i, c30);
      store(to + 3 * stride + i + kLanes, c31);
    }
    if (i < size) {
      LdlLanes c0, c1, c2, c3, a;
      load(to + i, c0);
      load(to + stride + i, c1);
      load(to + 2 * stride + i, c2);
      load(to + 3 * stride + i, c3);
      const double* lk = l + i;
      const double* wk = w + column;
      for (int k = 0; k < count; ++k, lk += stride, wk += stride) {
        load(lk, a);
        c0 -= a * wk[0];
        c1 -= a * wk[1];
        c2 -= a * wk[2];
        c3 -= a * wk[3];
      }
      store(to + i, c0);
      store(to + stride + i, c1);
      store(to + 2 * stride + i, c2);
      store(to + 3 * stride + i, c3);
    }
  }
  for (; column < size; ++column) {  // at most three columns of at most three rows
    double* to = f + static_cast<long>(column) * stride;
    for (int k = 0; k < count; ++k) {
      const double wk = w[static_cast<long>(k) * stride + column];
      for (int i = column; i < size; ++i) to[i] -= l[static_cast<long>(k) * stride + i] * wk;
    }
  }
}

SPARFLOW_INLINE void solve_forward(int stride, int count, const double* panel, double* x) {
  LdlLanes a, b;
  for (int k = 0; k < count; ++k, panel += stride) {
    const double value = x[k];
    for (int i = (k + 1) / kLanes * kLanes; i < stride; i += kLanes) {
      load(x + i, a);
      load(panel + i, b);
      store(x + i, a - b * value);
    }
  }
}

SPARFLOW_INLINE void solve_backward(int stride, int count, const double* panel, double* x) {
  LdlLanes a, b;
  panel += static_cast<long>(count - 1) * stride;
  for (int k = count - 1; k >= 0; --k, panel -= stride) {
    LdlLanes sum = {0.0, 0.0, 0.0, 0.0};
    for (int i = (k + 1) / kLanes * kLanes; i < stride; i += kLanes) {
      load(x + i, a);
      load(panel + i, b);
      sum += a * b;
    }
    x[k] -= (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }
}

double largest_baseline(int size, const double* column) { return largest_entry(size, column); }
void update_baseline(double* f, int stride, int first, int last, int size, const double* l1,
                     const double* w1, const double* l2, const double* w2) {
  update_columns(f, stride, first, last, size, l1, w1, l2, w2);
}
void product_baseline(double* f, int stride, int first, int size, const double* l, const double* w,
                      int count) {
  subtract_product(f, stride, first, size, l, w, count);
}
void forward_baseline(int stride, int count, const double* panel, double* x) {
  solve_forward(stride, count, panel, x);
}
void backward_baseline(int stride, int count, const double* panel, double* x) {
  solve_backward(stride, count, panel, x);
}
constexpr LdlKernel kLdlBaseline = {largest_baseline, update_baseline, product_baseline,
                                    forward_baseline, backward_baseline};

#if defined(__x86_64__)
#define SPARFLOW_AVX2 __attribute__((target("avx2,fma")))
SPARFLOW_AVX2
double largest_avx2(int size, const double* column) { return largest_entry(size, column); }
SPARFLOW_AVX2
void update_avx2(double* f, int stride, int first, int last, int size, const double* l1,
                 const double* w1, const double* l2, const double* w2) {
  update_columns(f, stride, first, last, size, l1, w1, l2, w2);
}
SPARFLOW_AVX2
void product_avx2(double* f, int stride, int first, int size, const double* l, const double* w,
                  int count) {
  subtract_product(f, stride, first, size, l, w, count);
}
SPARFLOW_AVX2
void forward_avx2(int stride, int count, const double* panel, double* x) {
  solve_forward(stride, count, panel, x);
}
SPARFLOW_AVX2
void backward_avx2(int stride, int count, const double* panel, double* x) {
  solve_backward(stride, count, panel, x);
}
constexpr LdlKernel kLdlAvx2 = {largest_avx2, update_avx2, product_avx2, forward_avx2,
                                backward_avx2};
#undef SPARFLOW_AVX2
#endif
#undef SPARFLOW_INLINE

}  // namespace

const LdlKernel& ldl_kernel() {
#if defined(__x86_64__)
  static const bool avx2 =
      __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  if (avx2) return kLdlAvx2;
#endif
  return kLdlBaseline;
}

}  // namespace sparflow::detail

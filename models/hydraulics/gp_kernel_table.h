#pragma once
/// Kernel functions of one instruction set; models/hydraulics/gp_kernel.cpp chooses one of these tables.
#include "models/hydraulics/gp_kernel.h"

namespace sparflow {

struct KernelTable {
  double (*sum)(const KernelCentres&, double, double);
  KernelSums (*sum_derivatives)(const KernelCentres&, double, double);
  void (*vector)(const KernelCentres&, double, double, double*);
};

const KernelTable& kernel_table_baseline();
#ifdef __x86_64__
const KernelTable& kernel_table_avx2();
const KernelTable& kernel_table_avx512();
#endif

}  // namespace sparflow

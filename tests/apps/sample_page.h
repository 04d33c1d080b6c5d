#pragma once
/// A page with every kind of figure, with invented but realistic data.
#include "apps/report/page/page.h"

namespace sparflow::test_support {

Page sample_page();

}  // namespace sparflow::test_support

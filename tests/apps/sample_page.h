#pragma once
/// A page with every kind of figure, filled with made-up but realistic data.
#include "apps/report/page/page.h"

namespace sparflow::test_support {

Page sample_page();

}  // namespace sparflow::test_support

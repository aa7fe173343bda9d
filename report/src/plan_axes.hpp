#pragma once

#include "scanloc/report/chart.hpp"

namespace scanloc::report {

/// Axes of a map seen from above that reach a little beyond all points of the chart.
void SetPlanAxes(LineChart* chart);

}  // namespace scanloc::report

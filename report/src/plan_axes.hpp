#pragma once

#include "scanloc/report/chart.hpp"

namespace scanloc::report {

/// How wide a map is drawn.
inline constexpr double kPictureWidth_px = 1100.0;

/// Axes of a map seen from above that reach a little beyond all points of the chart.
void SetPlanAxes(LineChart* chart);

}  // namespace scanloc::report

#pragma once

#include <prometheus/collectable.h>
#include <prometheus/metric_family.h>

#include <vector>

namespace scanloc::server {

/// What the system says of this process, by the names that Prometheus' own libraries use.
class ProcessMetrics : public prometheus::Collectable {
 public:
  [[nodiscard]] std::vector<prometheus::MetricFamily> Collect() const override;
};

/// A family of one gauge, or counter, without labels.
[[nodiscard]] prometheus::MetricFamily FamilyOf(const char* name, const char* help,
                                                prometheus::MetricType type, double value);

}  // namespace scanloc::server

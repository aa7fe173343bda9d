#include "ops/process_metrics.hpp"

#include <dirent.h>
#include <sys/resource.h>

#include <memory>

#include "front/memory.hpp"

namespace scanloc::server {
namespace {

double NumEntries(const char* folder) {
  const std::unique_ptr<DIR, int (*)(DIR*)> open(opendir(folder), closedir);
  if (open == nullptr) return 0.0;
  double count = 0.0;
  while (const dirent* entry = readdir(open.get())) count += entry->d_name[0] == '.' ? 0.0 : 1.0;
  return count;
}

double CpuSeconds() {
  rusage usage = {};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0.0;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

prometheus::MetricFamily FamilyOf(const char* name, const char* help, prometheus::MetricType type,
                                  double value) {
  prometheus::ClientMetric metric;
  metric.gauge.value = value;
  metric.counter.value = value;
  return {name, help, type, {metric}};
}

std::vector<prometheus::MetricFamily> ProcessMetrics::Collect() const {
  using prometheus::MetricType;
  return {
      FamilyOf("process_resident_memory_bytes", "Memory that the process holds [bytes].",
               MetricType::Gauge, static_cast<double>(MeasureMemory().resident_bytes)),
      FamilyOf("process_open_fds", "Open files and connections.", MetricType::Gauge,
               NumEntries("/proc/self/fd")),
      FamilyOf("process_threads", "Threads of the process.", MetricType::Gauge,
               NumEntries("/proc/self/task")),
      FamilyOf("process_cpu_seconds_total", "Processor time used [s].", MetricType::Counter,
               CpuSeconds()),
  };
}

}  // namespace scanloc::server

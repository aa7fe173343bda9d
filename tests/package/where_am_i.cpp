#include <cstdio>
#include <scanloc/client/client.hpp>

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: where_am_i HOST:PORT\n"), 2;
  const auto client = scanloc::client::Client::Connect({.address = argv[1]});
  if (!client.ok()) return std::fprintf(stderr, "%s\n", client.status().ToString().c_str()), 1;

  scanloc::PointCloud scan;  // from your LiDAR: x forward, y left, z up [m]
  for (int i = 0; i < 400; ++i) scan.push_back({10.0F, 0.5F * i - 100.0F, 1.0F});

  const auto reply = client->LocalizeByDescriptor(scan);
  if (!reply.ok()) return std::fprintf(stderr, "%s\n", reply.status().ToString().c_str()), 1;
  const scanloc::Answer& answer = reply->answer;
  std::printf("%s: %s\n", scanloc::OutcomeName(answer.outcome), answer.reason.c_str());
  if (answer.outcome != scanloc::Outcome::kLocalized) return 0;
  const auto at = answer.candidates.front().T_map_query.translation();
  std::printf("x %.2f m, y %.2f m\n", at.x(), at.y());
}

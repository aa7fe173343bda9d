#include <cstdio>
#include <scanloc/client/async_client.hpp>
#include <scanloc/client/offline_client.hpp>

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: where_am_i_offline MAP\n"), 2;
  const auto client = scanloc::client::OfflineClient::Open(argv[1]);
  if (!client.ok()) return std::fprintf(stderr, "%s\n", client.status().ToString().c_str()), 1;
  scanloc::client::AsyncClient async(*client);
  const auto reply = async.LocalizeScan({{1.0F, 2.0F, 3.0F}}).get();
  if (!reply.ok()) return std::fprintf(stderr, "%s\n", reply.status().ToString().c_str()), 1;
  std::printf("%s: %s\n", scanloc::OutcomeName(reply->answer.outcome),
              reply->answer.reason.c_str());
}

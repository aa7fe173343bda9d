import sys
import grpc
import numpy
from scanloc.v1 import localization_pb2 as wire
from scanloc.v1 import localization_pb2_grpc as service

points = numpy.fromfile(sys.argv[2], "<f4").reshape(-1, 4)[:, :3]  # KITTI: x y z intensity
scan = wire.ScanPoints(num_points=len(points), xyz_f32le=points.astype("<f4").tobytes())
with grpc.insecure_channel(sys.argv[1]) as channel:
    query = wire.LocalizeRequest(scan=scan)
    answer = service.LocalizationStub(channel).Localize(query, timeout=5)
print(wire.Outcome.Name(answer.outcome), answer.reason)
if answer.outcome == wire.OUTCOME_LOCALIZED:
    print(answer.candidates[0].T_map_query)

"""A web server of a folder, with GET and PUT, on a free port of this machine; prints the port.

While there is a file `slow` in the folder, an answer gets no further than its first bytes.
"""
import http.server
import os
import sys
import time

FOLDER = sys.argv[1]


class Handler(http.server.SimpleHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def __init__(self, *args):
        super().__init__(*args, directory=FOLDER)

    def copyfile(self, source, outputfile):
        if not os.path.exists(os.path.join(FOLDER, "slow")):
            return super().copyfile(source, outputfile)
        outputfile.write(source.read(100))
        outputfile.flush()
        while os.path.exists(os.path.join(FOLDER, "slow")):
            time.sleep(0.05)
        super().copyfile(source, outputfile)

    def do_PUT(self):
        path = self.translate_path(self.path)
        data = self.rfile.read(int(self.headers["Content-Length"]))
        with open(path + ".part", "wb") as file:
            file.write(data)
        os.rename(path + ".part", path)
        self.send_response(201)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *args):
        pass


server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
print(server.server_address[1], flush=True)
server.serve_forever()

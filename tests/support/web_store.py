"""A web server of a folder, with GET, HEAD and PUT, on a free port of this machine; prints the port.

As S3 does it gives the MD5 of a file as its ETag.

While there is a file `slow` in the folder, an answer gets no further than its first bytes. While there
is a file `status`, every answer has the status that it holds, and some text.
"""
import hashlib
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

    def answers_otherwise(self):
        path = os.path.join(FOLDER, "status")
        if not os.path.exists(path):
            return False
        if self.command == "PUT":
            self.rfile.read(int(self.headers["Content-Length"]))
        with open(path) as file:
            self.send_response(int(file.read()))
        self.send_header("Location", "http://127.0.0.1:1/elsewhere")
        self.send_header("Content-Length", "4")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(b"else")
        return True

    def do_GET(self):
        if not self.answers_otherwise():
            super().do_GET()

    def do_HEAD(self):
        if not self.answers_otherwise():
            super().do_HEAD()

    def send_header(self, keyword, value):
        super().send_header(keyword, value)
        path = self.translate_path(self.path)
        if keyword == "Last-Modified":
            with open(path, "rb") as file:
                super().send_header("ETag", f'"{hashlib.md5(file.read()).hexdigest()}"')

    def do_PUT(self):
        if self.answers_otherwise():
            return
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

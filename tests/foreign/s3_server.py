"""Serves S3 on the loopback: s3_server.py PORT_FILE

Passes over conditions in the bucket `careless`, and tells whoever asks the bucket `slow` at every third time to slow down.
"""
import itertools
import sys
from pathlib import Path

from moto.server import DomainDispatcherApplication, create_backend_app
from werkzeug.serving import make_server

SLOW_DOWN = b"<Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>"

app = DomainDispatcherApplication(create_backend_app)
requests_of_slow = itertools.count(1)


def serve(environ, start_response):
    path = environ.get("PATH_INFO", "")
    if path.startswith("/careless"):
        environ.pop("HTTP_IF_NONE_MATCH", None)
    if path.startswith("/slow/") and next(requests_of_slow) % 3 == 0:
        start_response("503 Slow Down", [("Content-Type", "application/xml"), ("Content-Length", str(len(SLOW_DOWN)))])
        return [SLOW_DOWN]
    return app(environ, start_response)


server = make_server("127.0.0.1", 0, serve, threaded=True)
Path(sys.argv[1]).write_text(str(server.server_port))
server.serve_forever()

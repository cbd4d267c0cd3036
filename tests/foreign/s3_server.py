"""Serves S3 on the loopback, and passes over conditions in the bucket `careless`: s3_server.py PORT_FILE"""
import sys
from pathlib import Path

from moto.server import DomainDispatcherApplication, create_backend_app
from werkzeug.serving import make_server

app = DomainDispatcherApplication(create_backend_app)


def serve(environ, start_response):
    if environ.get("PATH_INFO", "").startswith("/careless"):
        environ.pop("HTTP_IF_NONE_MATCH", None)
    return app(environ, start_response)


server = make_server("127.0.0.1", 0, serve, threaded=True)
Path(sys.argv[1]).write_text(str(server.server_port))
server.serve_forever()

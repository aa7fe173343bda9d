"""What scanloc raises, by kind."""


class Error(Exception):
    """Each of the others is one of these; the text says what, which value and what to do."""


class InvalidArgument(Error, ValueError):
    """A bad scan, array or option."""


class NotFound(Error, LookupError):
    """No such file or map."""


class AlreadyExists(Error):
    """It would overwrite something."""


class FailedPrecondition(Error):
    """Descriptors of other parameters, a method that the map does not serve, or a newer file."""


class DataLoss(Error):
    """A map file that is damaged."""


class Unavailable(Error, ConnectionError):
    """The server cannot be reached or is busy, or a build has the file: try again."""


class ResourceExhausted(Error):
    """Over a limit, of the server or of scanloc."""


class DeadlineExceeded(Error, TimeoutError):
    """No answer within the timeout."""


class Unauthenticated(Error):
    """The server wants a token, and not this one."""


class PermissionDenied(Error, PermissionError):
    """The token, or the rights to a file, do not allow it."""


class Cancelled(Error):
    """It was ended from outside."""


class Unimplemented(Error):
    """The server does not offer it."""

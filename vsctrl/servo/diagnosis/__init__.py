"""Why a run did not come to its reference, and which remedy helps: tried before it is advised."""

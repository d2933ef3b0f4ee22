"""An address of the tab's own."""

from fastapi import APIRouter

router = APIRouter()


@router.get("/api/v1/steps/marker/words")
async def words() -> dict[str, str]:
    return {"words": "a marker"}
